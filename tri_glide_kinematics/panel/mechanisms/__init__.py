"""The mechanisms tab: four-bar linkages and F-mechanisms, asked from ``mechanism_node``.

For other parts of the panel: ``MechanismsTab`` in ``tab``, ``MechanismRequests`` in ``requests``.
"""
