"""The page in the browser that shows a machine live and drives it.

``panel_node`` is the node, ``command`` starts it with a simulated machine. ``machine`` has what the
machine and the operators tell each other, ``page`` leads to the browser, where ``guard`` lets in
those that ``admission`` admits. ``tabs`` hold what the operator sees and does.
"""
