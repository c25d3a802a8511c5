"""Commands: one module each, from a command line to files, pictures and an exit code.

Each has ``main`` and ``make_parser``. ROS is loaded to drive (``drive``) and to let a machine swing
(``ringdown``) only. Slow modules are imported after the command line has been read, so that a
mistake in it is told at once, and Ctrl-C ends the process while modules are still being loaded.
"""
