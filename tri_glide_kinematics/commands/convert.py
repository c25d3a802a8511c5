"""The command ``convert``: settings of a firmware to a parameter file, and back; without ROS."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from tri_glide_kinematics.picture_commands import add_file, exit_code, next_line

FIRMWARES = ("klipper", "marlin", "reprap")


def main(arguments: Sequence[str] | None = None) -> int:
    """Convert settings from the command line.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0 if all is written, 1 after an error, 130 after Ctrl-C.
    """
    options = make_parser().parse_args(arguments)
    return exit_code("convert", lambda: _convert(options))


def _convert(options: argparse.Namespace) -> None:
    """Write the parameter file and settings of programs, or the lines, or print what is asked for.

    Raises:
        KinematicsError: if the files have no settings that can be held here, or a file cannot be
            written; if another file is in the way, nothing is.
    """
    from tri_glide_kinematics.files import check_place, find_file, replace_file
    from tri_glide_kinematics.firmwares import (
        Firmware,
        FirmwareError,
        firmware_text,
        load_firmware_settings,
        load_parameters,
        parameter_text,
        program_settings_text,
    )

    signal.signal(signal.SIGINT, signal.default_int_handler)
    files = [find_file(file) for file in options.files]
    if options.to:
        text = firmware_text(*load_parameters(*files), Firmware(options.to))
    else:
        given = Firmware(options.given) if options.given else None
        settings = load_firmware_settings(*files, firmware=given)
        text = parameter_text(settings)
        for note in settings.notes:
            print(f"convert: note: {note}", file=sys.stderr)
    if options.output is None:
        print(text, end="")
        return
    written = {options.output: ("lines for the firmware" if options.to else "parameter file", text)}
    if not options.to:
        # Those that come with the package have the bed of another machine.
        programs = options.output.with_name(f"{options.output.stem}_programs.yaml")
        written[programs] = ("settings of programs", program_settings_text(settings))
    for write in (check_place, replace_file):
        for file, (name, content) in written.items():
            with FirmwareError.of_writing(file):
                file.parent.mkdir(parents=True, exist_ok=True)
                write(file, content)
            if write is replace_file:
                print(f"{name}: {file}")
    if not options.to:
        own = ("--parameters", options.output, "--settings", programs)
        print(next_line("drive", "PROGRAM", "--check", *own))


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Convert settings of Klipper, Marlin or RepRapFirmware to a parameter file for "
        "all nodes, and with --to back to the lines that its owner types. What such files do not "
        "say has a default, which is told. It needs no ROS.",
    )
    parser.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="printer.cfg, Configuration.h, what M503 prints, config.g or config-override.g; with "
        "--to, parameters of the machine; of two files, the later one wins",
    )
    parser.add_argument(
        "--from",
        dest="given",
        choices=FIRMWARES,
        help="whose settings they are (default: seen from the file)",
    )
    parser.add_argument("--to", choices=FIRMWARES, help="whose lines to write")
    meaning = "write to this file, and settings of programs beside it (default: print)"
    add_file(parser, "--output", meaning)
    return parser


if __name__ == "__main__":
    sys.exit(main())
