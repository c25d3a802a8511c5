"""ROS: what the nodes share.

``starting`` starts and ends them, ``loop`` and ``serving`` let them work, ``live_parameters`` may
change while they do. What comes in is read by ``inputs``, with the checks of ``messages``; what
goes out is written by ``outputs``, as bytes by ``cdr`` where messages of Python would take too
long.
"""
