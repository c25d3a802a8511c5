"""Control: what a machine's controller decides, without ROS and without a clock.

For other rooms: ``controller``, ``status`` and ``operating_state``; ``supervision`` and
``in_position`` for its bounds; ``health``, ``controller_health``, ``loop_statistics`` and
``reason_log`` for what a node says about itself; ``simulated_sliders``.
"""
