"""The command ``calibrate``: from measurements to a report, a picture, a parameter file."""

from __future__ import annotations

import argparse
import shlex
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from tri_glide_kinematics.picture_commands import add_output, exit_code, whole_number

REPORT, PICTURE, PARAMETERS = "calibration.txt", "calibration.png", "calibrated.yaml"
MEASUREMENTS = "measurements.yaml"


def main(arguments: Sequence[str] | None = None) -> int:
    """Calibrate from the command line.

    Returns:
        Exit code: 0 if there is a calibration, 1 after an error, 130 after Ctrl-C.
    """
    parser = make_parser()
    options = parser.parse_args(arguments)
    if options.file is None:
        # Options that take several files have taken this one, too.
        parser.error("name the file that is to be calibrated first: calibrate FILE --settings A B")
    return exit_code("calibrate", lambda: _calibrate(options))


def _calibrate(options: argparse.Namespace) -> None:
    """Calibrate, tell of it and write all files.

    Raises:
        KinematicsError: if there is no calibration, or one that no node should use.
    """
    from tri_glide_kinematics.calibration.fit import load_measurements, save_measurements
    from tri_glide_kinematics.calibration.session import (
        SavingError,
        contradiction,
        proposed,
        report,
        save_parameters,
        solved,
    )
    from tri_glide_kinematics.files import find_file, write_file
    from tri_glide_kinematics.firmwares import (
        check_no_log,
        firmware_lines,
        load_firmware_settings,
        load_log,
    )

    signal.signal(signal.SIGINT, signal.default_int_handler)
    file, folder = find_file(options.file), options.output
    settings = load_firmware_settings(*options.settings) if options.settings else None
    is_log = settings is not None and file.suffix.lower() not in (".yaml", ".yml")
    if settings is not None and is_log:
        content, notes = load_log((file, *options.places), settings)
        for note in (*settings.notes, *notes):
            print(f"calibrate: note: {note}", file=sys.stderr)
    else:
        check_no_log(file)
        content = load_measurements(file)
    calibration = solved(content)
    text = report(calibration, *proposed(content, calibration, options.next))
    print(text)
    folder.mkdir(parents=True, exist_ok=True)
    write_file(folder / REPORT, f"{text}\n")
    from tri_glide_kinematics.figures import calibration_figure
    from tri_glide_kinematics.picture_commands import save_figure

    save_figure(calibration_figure(calibration), folder / PICTURE, 110)
    print(f"\nreport: {folder / REPORT}\npicture: {folder / PICTURE}")
    if is_log:
        save_measurements(folder / MEASUREMENTS, content)
        print(f"measurements, with priors and deviations: {folder / MEASUREMENTS}")
    if calibration.is_contradicted and not options.force:
        reason = contradiction(calibration)
        raise SavingError(f"no parameter file without --force: {reason}")
    save_parameters(folder / PARAMETERS, calibration.machine, calibration.nominal)
    print(f"parameter file for all nodes: {folder / PARAMETERS}")
    if settings is None:
        launch = "next: ros2 launch tri_glide_kinematics tri_glide.launch.py"
        print(f"{launch} {shlex.quote(f'calibrated:={folder / PARAMETERS}')}")
    else:
        print(firmware_lines(calibration.machine, settings))


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = argparse.ArgumentParser(
        description="Find the machine that explains measurements best: touches of a plate, "
        "measured positions, distances between positions. Writes a report, a picture and a "
        "parameter file that all nodes take, and prints the lines for a firmware."
    )
    parser.add_argument(
        "file",
        type=Path,
        nargs="?",
        help="measurements, or the name of a file that is installed in config/; with --settings, "
        "what a firmware measured: printer.cfg with [delta_calibrate], what Marlin printed of G30 "
        "or G33, heightmap.csv, or what G32 printed",
    )
    add_output(parser, Path("out"))
    for name, meaning in (
        (
            "--settings",
            "settings with which a firmware measured: printer.cfg, Configuration.h, "
            "config.g; of several, the later one wins",
        ),
        ("--places", "bed.g, with the places of G32"),
    ):
        parser.add_argument(
            name, type=Path, nargs="+", action="extend", default=[], metavar="FILE", help=meaning
        )
    parser.add_argument(
        "--next",
        type=whole_number(0, 100),
        default=5,
        metavar="N",
        help="how many measurements to propose, 0 to 100 (default: 5)",
    )
    parser.add_argument(
        "--force",
        action="store_true",
        help="write the parameter file even if measurements and assumptions contradict each other",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
