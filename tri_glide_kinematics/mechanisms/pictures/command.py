"""The command ``draw_mechanism``: pictures of a mechanism from a file such as those in ``config/``.

Drawing is imported after the command line has been read, so that a mistake in it is told at once
and Ctrl-C ends the process while modules are still being loaded.
"""

from __future__ import annotations

import argparse
import math
import signal
import sys
from collections.abc import Sequence

from tri_glide_kinematics.files import find_file
from tri_glide_kinematics.picture_commands import command_parser, exit_code, number, whole_number

MOST_FRAMES = 720  # of an animation


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw from the command line.

    Returns:
        Exit code: 0 if all is drawn, 1 after an error, 130 after Ctrl-C.
    """
    options = make_parser().parse_args(arguments)
    return exit_code("draw_mechanism", lambda: _draw(options))


def _draw(options: argparse.Namespace) -> None:
    """Draw, and say which files were written."""
    from tri_glide_kinematics.mechanisms.pictures.picture_set import Choice, save_pictures

    signal.signal(signal.SIGINT, signal.default_int_handler)
    angle = options.crank_angle
    choice = Choice(
        branch=options.branch,
        crank_angle=None if angle is None else math.radians(angle),
        frames=options.frames if options.animate else 0,
    )
    print("\n".join(save_pictures(find_file(options.file), options.output, choice)))


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = command_parser(
        "Draw an F-mechanism or a four-bar linkage from a file. F-mechanism: the platform angle "
        "over the crank angle on all branches, the paths of the platform joints on one branch, all "
        "positions at one crank angle, all positions of the platform joints. Four-bar linkage: the "
        "coupler curve, and all angles over the crank angle.",
        "mechanism file, or the name of one that is installed in config/",
    )
    parser.add_argument(
        "--branch",
        type=int,
        metavar="N",
        help="branch to draw, from 1; of a four-bar linkage 1 is open and 2 crossed (default: one "
        "that turns fully if there is one, or the branch on which the linkage is given)",
    )
    parser.add_argument(
        "--crank-angle",
        type=number("a finite number"),
        metavar="DEG",
        help="crank angle at which positions are drawn, in degrees",
    )
    parser.add_argument("--animate", action="store_true", help="save the motion as a GIF as well")
    parser.add_argument(
        "--frames",
        type=whole_number(2, MOST_FRAMES),
        default=60,
        metavar="N",
        help=f"frames of the animation, 2 to {MOST_FRAMES} (default: 60)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
