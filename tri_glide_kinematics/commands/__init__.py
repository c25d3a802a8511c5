"""Commands: one module each, from a command line to files, pictures and an exit code.

Each has ``main`` and ``make_parser``. ROS is loaded to drive (``drive``) and to let a machine swing
(``ringdown``) only.
"""
