"""The command ``draw_machine``: maps of a machine, the surface of its workspace; without ROS."""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Sequence

from tri_glide_kinematics.picture_commands import (
    MILLIMETRES,
    above_zero,
    add_file,
    add_node_argument,
    check_apart,
    command_parser,
    exit_code,
    save_figure,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw a machine from the command line.

    Args:
        arguments: of the command; None for those of the process.

    Returns:
        Exit code: 0 if all is written, 1 after an error, 130 after Ctrl-C.
    """
    options = make_parser().parse_args(arguments)
    return exit_code("draw_machine", lambda: _draw(options))


def _draw(options: argparse.Namespace) -> None:
    """Draw the maps and write all files.

    Raises:
        KinematicsError: if the file has no machine, or one without a workspace.
        OSError: if a file cannot be written.
    """
    from tri_glide_kinematics.errors import KinematicsError
    from tri_glide_kinematics.figures import machine_figure
    from tri_glide_kinematics.files import find_file, write_file
    from tri_glide_kinematics.settings import (
        IK_NODE,
        file_values,
        limits_of,
        workspace_of,
    )
    from tri_glide_kinematics.sizing import (
        NoCylinderError,
        glb_bytes,
        inscribed_height,
        inscribed_radius,
        stl_bytes,
        surface,
    )

    signal.signal(signal.SIGINT, signal.default_int_handler)
    file = find_file(options.file)
    check_apart((file, options.measurements), (options.stl, options.glb))
    values = file_values(str(file), options.node, IK_NODE)
    workspace = workspace_of(values)
    deviations = None
    if options.measurements is not None:
        from tri_glide_kinematics.calibration.fit import load_measurements
        from tri_glide_kinematics.calibration.session import solved

        calibration = solved(load_measurements(find_file(options.measurements)))
        deviations = calibration.position_uncertainties
    mesh = surface(workspace)
    if not len(mesh.triangles):
        raise KinematicsError(f"{file}: the platform may be nowhere")
    print(f"{file}: the platform may be in {1e3 * mesh.volume:.3f} litres")
    try:
        radius = inscribed_radius(workspace)
        print(f"widest level disc about the axis: radius {MILLIMETRES * radius:.3f} mm")
        bottom, top = inscribed_height(workspace, 0.5 * radius)
        print(
            f"tallest cylinder of half that radius: z from {MILLIMETRES * bottom:.3f} to "
            f"{MILLIMETRES * top:.3f} mm"
        )
    except NoCylinderError as error:
        print(f"about the axis: {error}")
    folders = [each.parent for each in (options.stl, options.glb) if each]
    for folder in (options.output, *folders):
        folder.mkdir(parents=True, exist_ok=True)
    for target, content in ((options.stl, stl_bytes), (options.glb, glb_bytes)):
        if target is not None:
            write_file(target, content(mesh))
            print(f"surface: {target}")
    velocities = limits_of(values).with_velocity_scaled(values["speed_scale"]).velocity
    figure = machine_figure(workspace, velocities, options.resolution, file.name, deviations)
    picture = options.output / f"{file.stem}_machine.png"
    save_figure(figure, picture, 100)
    print(f"picture: {picture}")


def make_parser() -> argparse.ArgumentParser:
    """Return what reads the command line; its name is that of the program."""
    parser = command_parser(
        "Draw maps of a machine: condition number, speed, force, resolution, stiffness, and cuts "
        "through its workspace. It needs no ROS and no machine.",
        "parameters of the machine; those of config/ are found by their name alone",
    )
    add_node_argument(parser)
    parser.add_argument(
        "--resolution",
        type=above_zero("metres"),
        default=1e-5,
        metavar="METRES",
        help="step of the drives (default: 0.00001)",
    )
    add_file(
        parser, "--measurements", "measurements of a calibration, whose uncertainty is drawn, too"
    )
    add_file(parser, "--stl", "write the surface of the workspace in STL, in mm")
    add_file(parser, "--glb", "write it as binary glTF, in metres")
    return parser


if __name__ == "__main__":
    sys.exit(main())
