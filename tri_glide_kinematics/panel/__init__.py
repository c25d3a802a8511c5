"""The page in the browser that shows a machine live and drives it.

``panel_node`` is the node, ``command`` starts it with a simulated machine. ``link`` leads to the
machine, ``operator_requests`` to the operators, in the ``words`` of the page; ``page`` leads to the
browser, where ``admission`` lets in those that it knows. ``tabs`` hold what the operator sees and
does.
"""
