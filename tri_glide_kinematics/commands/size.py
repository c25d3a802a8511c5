"""The command ``size``: from what a machine has to do to its lengths and motors; without ROS."""

from __future__ import annotations

import argparse
import math
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tri_glide_kinematics.files import SETTINGS, find_file
from tri_glide_kinematics.picture_commands import MILLIMETRES, add_file, add_unit, exit_code
from tri_glide_kinematics.wording import number_text

if TYPE_CHECKING:
    from tri_glide_kinematics.sizing import Cycle, DutyLoad, Sizing, Wish

# Numbers of a wish that have the same name on the command line: name, unit, meaning.
NUMBERS = (
    ("payload", "KG", "on the platform"),
    ("carriage-mass", "KG", "of each slider"),
    ("arm-density", "KG/M", "mass of an arm, both rods of it, for each metre"),
    ("platform-mass", "KG", "with the tool"),
    ("platform-radius", "M", "of the circle through the platform joints, as the tool needs it"),
    ("drive-resolution", "M", "step of the drives"),
    ("platform-resolution", "M", "coarsest step of the platform; default: any"),
    ("largest-base-radius", "M", "room for the towers; default: any"),
    ("largest-column-height", "M", "from the lower end of the volume up; default: any"),
    ("largest-force", "N", "of a slider; default: any"),
    ("largest-slider-speed", "M/S", "default: any"),
    ("max-condition-number", "K", "of the Jacobian"),
    ("least-arm-angle", "DEGREES", "of an arm from the level"),
    ("clearance", "M", "least level distance of a platform joint from its tower joint"),
    ("end-margin", "M", "of travel at both ends"),
    ("jerk-time", "S", "in which the acceleration builds up"),
    ("orientation", "DEGREES", "of the first tower, counter-clockwise from the y axis"),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Size a machine from the command line.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0 if there is a machine, 1 after an error or for an impossible wish, 130 after
        Ctrl-C.
    """
    options = make_parser().parse_args(arguments)
    return exit_code("size", lambda: _size(options))


def _size(options: argparse.Namespace) -> int:
    """Size a machine, tell of it and write its file; return 0, or 1 for an impossible wish.

    Raises:
        KinematicsError: if the wish has a wrong number, or the duty cycle cannot be driven.
        OSError: if the file cannot be written.
    """
    from tri_glide_kinematics.files import replace_file
    from tri_glide_kinematics.settings import IK_NODE, file_values
    from tri_glide_kinematics.sizing import (
        ImpossibleWishError,
        Objective,
        duty_load,
        parameter_text,
        size,
    )

    signal.signal(signal.SIGINT, signal.default_int_handler)
    wish, cycle = _wish(options), _cycle(options)
    objective = Objective(options.objective)
    others = [each for each in Objective if each is not objective]
    possible = True
    try:
        best = size(wish, objective)
    except ImpossibleWishError as error:
        print(f"size: {error}", file=sys.stderr)
        print("the nearest possible wish loosens these demands as little as can be; its machine:")
        possible = False
        best = size(error.nearest, objective)
    machines = [best, *(size(best.wish, other) for other in others)]
    loads = [duty_load(machine, cycle) for machine in machines]
    heads = [f"least {each.value}" for each in (objective, *others)]
    print("\n".join(_table(heads, machines, loads)))
    if options.write is not None and (possible or options.nearest):
        folder = options.write.parent
        folder.mkdir(parents=True, exist_ok=True)
        replace_file(options.write, parameter_text(best))
        # Nodes bound their parameters, too.
        file_values(str(options.write), "/ik_node", IK_NODE)
        print(f"parameter file for all nodes, of the machine of {heads[0]}: {options.write}")
    return 0 if possible else 1


def _wish(options: argparse.Namespace) -> Wish:
    from tri_glide_kinematics.sizing import Box, Wish
    from tri_glide_kinematics.workspace import Cylinder

    x, y = options.center
    z = options.bottom
    volume: Cylinder | Box
    if options.cylinder:
        radius, height = options.cylinder
        volume = Cylinder(x, y, radius, z, z + height)
    else:
        width, depth, height = options.box
        half_width, half_depth = 0.5 * width, 0.5 * depth
        volume = Box(
            (x - half_width, y - half_depth, z), (x + half_width, y + half_depth, z + height)
        )
    given = {}
    for option, unit, _ in NUMBERS:
        name = option.replace("-", "_")
        value = getattr(options, name)
        if value is not None:
            given[name] = math.radians(value) if unit == "DEGREES" else value
    return Wish(volume, options.speed, options.acceleration, **given)


def _cycle(options: argparse.Namespace) -> Cycle | None:
    """Return what plans the motion of the file that is to be driven; None without one."""
    if options.drive is None:
        return None
    from tri_glide_kinematics.motion import SliderLimits, Trajectory
    from tri_glide_kinematics.programs import load_own_settings, load_work, time_steps
    from tri_glide_kinematics.workspace import Workspace

    work = load_work(find_file(options.drive), load_own_settings(options.settings), options.unit)

    def cycle(workspace: Workspace, limits: SliderLimits) -> Trajectory:
        return time_steps(work, workspace, limits).trajectory

    return cycle


def _table(
    heads: Sequence[str], machines: Sequence[Sizing], loads: Sequence[DutyLoad]
) -> list[str]:
    """Return the lines that tell of machines, side by side."""
    rows: list[tuple[str, Sequence[str]]] = [("", heads)]

    def add(name: str, values: Sequence[float], digits: int = 5) -> None:
        rows.append((name, [number_text(value, digits) for value in values]))

    add("base radius [mm]", [MILLIMETRES * each.base_radius for each in machines])
    add("platform radius [mm]", [MILLIMETRES * each.platform_radius for each in machines])
    add("arm length [mm]", [MILLIMETRES * each.arm_length for each in machines])
    for end, name in enumerate(("lower", "upper")):
        add(f"{name} end of travel [mm]", [MILLIMETRES * each.travel[end] for each in machines])
    travels = [each.travel[1] - each.travel[0] for each in machines]
    add("travel [mm]", [MILLIMETRES * travel for travel in travels])
    add("height of columns [mm]", [MILLIMETRES * each.column_height for each in machines])
    add("size [litres]", [1e3 * each.size for each in machines])
    rows.append(("at most, proved over the whole volume:", ["" for _ in machines]))
    add("  condition number", [each.condition_number for each in machines], 4)
    add("  platform resolution [um]", [1e6 * each.platform_resolution for each in machines], 4)
    add("  speed of a slider [m/s]", [each.slider_speed for each in machines], 4)
    add("  acceleration of a slider [m/s2]", [each.slider_acceleration for each in machines], 4)
    add("  force of a slider [N]", [each.force for each in machines], 4)
    add("  force times speed [W]", [each.power for each in machines], 4)
    rows.append(("in the duty cycle, the motor that has most to do:", ["" for _ in machines]))
    add("  time [s]", [each.duration for each in loads], 4)
    add("  largest force [N]", [max(each.peak_force) for each in loads], 4)
    add("  continuous force [N]", [max(each.continuous_force) for each in loads], 4)
    add("  largest speed [m/s]", [max(each.peak_speed) for each in loads], 4)
    add("  largest power [W]", [max(each.peak_power) for each in loads], 4)
    add("  mean power [W]", [max(each.mean_power) for each in loads], 4)
    widest = max(len(name) for name, _ in rows)
    lines = [f"{name:{widest}}" + "".join(f"{text:>14}" for text in texts) for name, texts in rows]
    for head, machine in zip(heads, machines):
        used = ", ".join(demand.value for demand in machine.tight) or "nothing"
        lines.append(f"{head}: used up to a hundredth: {used}")
    return [line.rstrip() for line in lines]


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Find the best machine for a volume, a speed and an acceleration, and what it "
        "asks of its motors. Each limit is proved over the whole volume. It needs no ROS. Lengths "
        "are in metres.",
        epilog="Exit code: 0 if there is a machine, 1 after an error or for an impossible wish.",
    )
    volume = parser.add_mutually_exclusive_group(required=True)
    volume.add_argument(
        "--cylinder",
        nargs=2,
        type=float,
        metavar=("RADIUS", "HEIGHT"),
        help="where the platform centre has to be able to be",
    )
    volume.add_argument(
        "--box", nargs=3, type=float, metavar=("X", "Y", "Z"), help="the same, with its sides"
    )
    parser.add_argument(
        "--center",
        nargs=2,
        type=float,
        default=(0.0, 0.0),
        metavar=("X", "Y"),
        help="middle of the volume, from the axis of the machine (default: 0 0)",
    )
    parser.add_argument(
        "--bottom", type=float, default=0.0, metavar="Z", help="its lower end (default: 0)"
    )
    parser.add_argument(
        "--speed",
        type=float,
        required=True,
        metavar="M/S",
        help="of the platform, in any direction",
    )
    parser.add_argument(
        "--acceleration",
        type=float,
        required=True,
        metavar="M/S2",
        help="of the platform, in any direction and at that speed",
    )
    for name, unit, meaning in NUMBERS:
        parser.add_argument(f"--{name}", type=float, metavar=unit, help=meaning)
    parser.add_argument(
        "--objective",
        choices=("size", "power"),
        default="size",
        help="what is to be least: size of the machine, or power of its motors (default: size); "
        "the other one is shown beside it",
    )
    add_file(
        parser,
        "--drive",
        "program, points or drive file for a duty cycle (default: 25 mm up, 305 mm across, "
        "25 mm down, and back)",
    )
    add_file(
        parser, "--settings", f"what a program does not say (default: {SETTINGS})", Path(SETTINGS)
    )
    add_unit(parser)
    add_file(parser, "--write", "write a parameter file for all nodes")
    parser.add_argument(
        "--nearest", action="store_true", help="write that of the nearest possible wish, too"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
