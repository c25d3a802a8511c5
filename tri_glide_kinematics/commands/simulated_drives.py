"""The command ``simulated_drives``: servo drives by CiA 402 behind a pseudo-terminal (slcan)."""

from __future__ import annotations

import argparse
import os
import select
import signal
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tri_glide_kinematics.drives import SimulatedDrive

GRAVITY = 9.81
# Greatest acceleration of a drive [m/s²].
STRENGTH = 50.0
# How far behind the edge of its switch a slider is stopped [m].
ZONE = 0.02


# What can be wrong with a drive, by the word for it: its value is a number, or an entry.
NUMBERS = ("abort_at", "answer_delay", "lost_statuses", "vendor_bits")
ENTRIES = ("absent", "read_only")
FAULTS = (
    f"{', '.join(NUMBERS)} NUMBER; {', '.join(ENTRIES)} INDEX:SUBINDEX; fault CODE; "
    "switch works, sticks or never; mute; drop_out; reset"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate drives until it is ended.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0, or 2 if the arguments are wrong.
    """
    parser = make_parser()
    options = parser.parse_args(arguments)
    if len(options.nodes) != len(options.heights):
        parser.error("there must be a height for each node")
    try:
        drives = _drives(options)
        for line in options.fault:
            make_wrong(drives, line)
    except ValueError as error:
        parser.error(str(error))
    return _serve(drives, options.link)


def _serve(drives: Mapping[int, SimulatedDrive], links: Sequence[Path]) -> int:
    from tri_glide_kinematics.drives import Terminals

    terminals = Terminals(max(len(links), 1))
    ended: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: ended.append(number))
    inputs = [0]

    def look() -> bool:
        """Tell what has happened, do what is typed, and say whether to go on."""
        for node, drive in drives.items():
            while drive.history:
                time, text = drive.history.popleft()
                print(f"{time:.3f} drive {node}: {text}", flush=True)
        if inputs and select.select(inputs, [], [], 0.0)[0]:
            typed = os.read(0, 4096).decode(errors="replace")
            if not typed:
                inputs.clear()
            for line in typed.splitlines():
                try:
                    make_wrong(drives, line)
                except ValueError as error:
                    print(error, flush=True)
        return not ended

    try:
        for link, path in zip(links, terminals.paths):
            link.unlink(missing_ok=True)
            link.symlink_to(path)
        print("drives at", *(links or terminals.paths), flush=True)
        terminals.serve(list(drives.values()), look)
    except OSError as error:
        print(f"simulated_drives: error: {error}", file=sys.stderr)
        return 2
    finally:
        for link in links:
            link.unlink(missing_ok=True)
        terminals.close()
    return 0


def make_wrong(drives: Mapping[int, SimulatedDrive], line: str) -> None:
    """Let something be wrong with a drive, from now on.

    Args:
        drives: by their nodes.
        line: node, word and value, for example ``2 fault 0x7500``.

    Raises:
        ValueError: if it has no meaning.
    """
    from tri_glide_kinematics.drives import Switch

    try:
        node, word, value = [*line.split(), ""][:3]
        drive = drives[int(node)]
        if word in NUMBERS:
            setattr(drive.faults, word, float(value) if word == "answer_delay" else int(value, 0))
        elif word in ENTRIES:
            index, _, subindex = value.partition(":")
            getattr(drive.faults, word).add((int(index, 16), int(subindex or "0", 16)))
        elif word == "switch":
            drive.axis.slider.switch = Switch(value)
        elif word == "fault":
            drive.axis.fail(int(value, 0))
        elif word == "mute":
            drive.faults.is_mute = True
        else:
            {"drop_out": drive.axis.drop_out, "reset": drive.reboot}[word]()
    except (ValueError, KeyError):
        text = f"{line!r} must be the node of a drive and one of: {FAULTS}"
        raise ValueError(text) from None


def _drives(options: argparse.Namespace) -> dict[int, SimulatedDrive]:
    """Return the drives by their nodes.

    Raises:
        ValueError: if two have the same.
    """
    from tri_glide_kinematics.drives import SimulatedDrive, Slider

    counts = options.direction * options.counts_per_metre
    lower, upper = sorted(counts * end for end in (options.bottom - ZONE, options.top + ZONE))
    now = time.monotonic()
    return {
        node: SimulatedDrive(
            node,
            Slider(
                lower=lower,
                upper=upper,
                switch_zone=abs(counts) * ZONE,
                strength=abs(counts) * STRENGTH,
                gravity=-counts * GRAVITY,
                has_brake=not options.no_brake,
                noise=options.noise,
            ),
            counts * height,
            now,
        )
        for node, height in zip(options.nodes, options.heights)
    }


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Simulate servo drives by CiA 402 on CANopen, behind a pseudo-terminal that "
        "speaks slcan as an adapter for CAN does. It needs no ROS.",
        epilog="Lines that are typed while it runs make something wrong with a drive, as --fault "
        f"does, for example: 2 fault 0x7500. What there is: {FAULTS}",
    )
    parser.add_argument(
        "--link",
        type=Path,
        action="append",
        default=[],
        metavar="PATH",
        help="make this symbolic link to the terminal; each one more is another adapter on the bus",
    )
    parser.add_argument("--nodes", type=int, nargs="+", default=[1, 2, 3], metavar="N")
    parser.add_argument(
        "--heights",
        type=float,
        nargs="+",
        default=[0.6, 0.6, 0.6],
        metavar="M",
        help="of the sliders at the start [m]",
    )
    for end, height in (("top", 0.92), ("bottom", 0.28)):
        text = f"where the switches at the {end} begin [m] (default: {height})"
        parser.add_argument(f"--{end}", type=float, default=height, metavar="M", help=text)
    parser.add_argument("--counts-per-metre", type=float, default=1e6, metavar="N")
    parser.add_argument("--direction", type=int, choices=(1, -1), default=1)
    parser.add_argument(
        "--noise", type=float, default=0.0, metavar="N", help="of encoders, in counts"
    )
    parser.add_argument("--no-brake", action="store_true", help="sliders fall without torque")
    parser.add_argument(
        "--fault", action="append", default=[], metavar="LINE", help="as it can be typed, see below"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
