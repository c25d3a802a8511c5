"""ROS: what the nodes share.

Starting and spinning (``run``, ``cycle_loop``, ``transport``, ``command_line``, ``processes``),
parameters (``parameters`` holds the tables), messages (``messages``, ``*_messages``,
``command_outputs``), services and diagnostics, and goals as a client sends them
(``goal_sender``, ``step_driver``).
"""
