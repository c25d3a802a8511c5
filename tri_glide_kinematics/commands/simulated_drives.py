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
# Where the switches begin, and how far behind that a slider is stopped [m].
SWITCHES = (0.28, 0.92)
ZONE = 0.02

FAULTS = (
    "abort_at, answer_delay, lost_statuses, vendor_bits NUMBER; absent, read_only INDEX:SUBINDEX; "
    "rounded INDEX:SUBINDEX NUMBER; fault CODE; switch works, sticks or never; no_brake; mute; "
    "drop_out; reset"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate drives until a signal comes.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0; wrong arguments end the process with 2.
    """
    parser = make_parser()
    options = parser.parse_args(arguments)
    drives = _drives(options)
    try:
        for line in options.fault:
            make_wrong(drives, line)
        _serve(drives, options.link)
    except (ValueError, OSError) as error:
        parser.error(str(error))
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
        node, *words = line.split()
        drive = drives[int(node)]
        faults, axis = drive.faults, drive.axis
        match words:
            case ["abort_at" | "lost_statuses" | "vendor_bits" as name, number]:
                setattr(faults, name, int(number, 0))
            case ["answer_delay", number]:
                faults.answer_delay = float(number)
            case ["absent" | "read_only" as name, entry]:
                getattr(faults, name).add(_address(entry))
            case ["rounded", entry, number]:
                faults.rounded[_address(entry)] = max(int(number, 0), 1)
            case ["fault", code]:
                axis.fail(int(code, 0))
            case ["switch", how]:
                axis.slider.switch = Switch(how)
            case ["no_brake"]:
                axis.slider.has_brake = False
            case ["mute"]:
                faults.is_mute = True
            case _:
                {"drop_out": axis.drop_out, "reset": drive.reboot}[" ".join(words)]()
    except (ValueError, KeyError):
        text = f"{line!r} must be the node of a drive and one of: {FAULTS}"
        raise ValueError(text) from None


def _address(entry: str) -> tuple[int, int]:
    index, _, subindex = entry.partition(":")
    return int(index, 16), int(subindex or "0", 16)


def _serve(drives: Mapping[int, SimulatedDrive], links: Sequence[Path]) -> None:
    """Serve the drives until a signal comes; tell what happens, and do what is typed."""
    from tri_glide_kinematics.drives import Terminals

    terminals = Terminals(max(len(links), 1))
    ended: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: ended.append(number))
    inputs = [sys.stdin.fileno()] if sys.stdin else []

    def look() -> bool:
        for node, drive in drives.items():
            while drive.history:
                at, text = drive.history.popleft()
                print(f"{at:.3f} drive {node}: {text}", flush=True)
        for file in select.select(inputs, [], [], 0.0)[0]:
            typed = os.read(file, 4096).decode(errors="replace")
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
            # That of one that was killed.
            if link.is_symlink():
                link.unlink()
            link.symlink_to(path)
        print("drives at", *(links or terminals.paths), flush=True)
        terminals.serve(list(drives.values()), look)
    finally:
        for link, path in zip(links, terminals.paths):
            if link.is_symlink() and str(link.readlink()) == path:
                link.unlink()
        terminals.close()


def _drives(options: argparse.Namespace) -> dict[int, SimulatedDrive]:
    """Return the drives by their nodes."""
    from tri_glide_kinematics.drives import SimulatedDrive, Slider

    counts, now, drives = options.counts_per_metre, time.monotonic(), {}
    lower, upper = sorted(counts * end for end in (SWITCHES[0] - ZONE, SWITCHES[1] + ZONE))
    for node, height in enumerate(options.heights, 1):
        slider = Slider(lower, upper, ZONE * abs(counts), STRENGTH * abs(counts))
        slider.gravity, slider.noise = -GRAVITY * counts, options.noise
        drives[node] = SimulatedDrive(node, slider, counts * height, now)
    return drives


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Simulate servo drives by CiA 402 on CANopen, with the nodes 1, 2, 3, behind a "
        "pseudo-terminal that speaks slcan as an adapter for CAN does. The switches for homing "
        f"begin at {SWITCHES[0]} and {SWITCHES[1]} m. It needs no ROS.",
        epilog="Lines that are typed while it runs make something wrong with a drive, as --fault "
        f"does, for example: 2 fault 0x7500. What there is: {FAULTS}",
    )
    add = parser.add_argument
    link = "make this symbolic link to the terminal; one more is another adapter"
    add("--link", type=Path, action="append", default=[], metavar="PATH", help=link)
    fault = "as it can be typed, see below"
    add("--fault", action="append", default=[], metavar="LINE", help=fault)
    counts = "negative where the drives count downwards (default: 1e6)"
    add("--counts-per-metre", type=float, default=1e6, metavar="N", help=counts)
    add("--noise", type=float, default=0.0, metavar="N", help="of the encoders, in counts")
    heights = "of the sliders at the start [m] (default: 0.6 0.6 0.6)"
    add("--heights", type=float, nargs=3, default=[0.6] * 3, metavar="M", help=heights)
    return parser


if __name__ == "__main__":
    sys.exit(main())
