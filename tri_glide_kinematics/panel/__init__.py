"""The page in the browser that shows a machine live and drives it.

``panel_node`` is the node, ``command`` starts it with a simulated machine. What the operator may do
is decided without ROS and without the page (``controls``, ``hold``, ``points``); ``machine_link``
is the way to the machine, ``page`` and what draws on it the way to the browser.
"""
