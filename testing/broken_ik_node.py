"""An ik_node whose planner is broken from SIGUSR1 on: whatever it plans raises an error.

Run it as ``python -m testing.broken_ik_node``, with the arguments of the node.
"""

import signal
import sys
from typing import NoReturn

from tri_glide_kinematics.ros.starting.run import run


def break_planner(*_: object) -> None:
    """Let all planning fail from now on."""
    from tri_glide_kinematics.motion.engine import Replanning, Tracker

    def fail(*_: object, **__: object) -> NoReturn:
        raise RuntimeError("the planner is broken")

    for name in ("with_goal", "braked", "tried_again", "continued"):
        setattr(Replanning, name, fail)
    Tracker.next = fail  # type: ignore[method-assign]


if __name__ == "__main__":
    signal.signal(signal.SIGUSR1, break_planner)
    sys.exit(run("tri_glide_kinematics.nodes.ik_node", "IkNode"))
