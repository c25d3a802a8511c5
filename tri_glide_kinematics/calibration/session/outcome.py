"""The outcome of a session: the calibration, what is measured next, the parameter file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tri_glide_kinematics.calibration.fit import (
    Calibration,
    MachineParameters,
    MeasurementFile,
    Proposal,
    calibrate,
)
from tri_glide_kinematics.calibration.session.session import SavingError
from tri_glide_kinematics.files import replace_file
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.wording import list_text
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

NOT_SAID = (
    "These places are not compared with the sliders' travel: the measurements come without a "
    "`workspace`"
)
NO_PLACE = "No place that would be worth measuring lies inside the workspace"


def solved(content: MeasurementFile) -> Calibration:
    """Return the calibration.

    Raises:
        CalibrationError: if there is none, with the reason.
    """
    return calibrate(
        content.nominal.geometry,
        content.touches,
        content.positions,
        content.distances,
        content.priors,
        height_offsets=content.nominal.height_offsets,
    )


def proposed(
    content: MeasurementFile, calibration: Calibration, count: int
) -> tuple[tuple[Proposal, ...], str]:
    """Return ``count`` measurements that would help most, and what is to be said of them."""
    if not count:
        return (), ""
    limits = content.workspace
    workspace = None if limits is None else workspace_of(calibration.machine, limits)
    proposals = calibration.next_points(count, workspace=workspace)
    return proposals, NO_PLACE if not proposals else NOT_SAID if limits is None else ""


def workspace_of(machine: MachineParameters, limits: WorkspaceLimits) -> Workspace:
    """Return the workspace of a machine.

    Args:
        machine: with its height offsets.
        limits: with the travel as the drives report it.
    """

    def true(heights: Vector3) -> Vector3:
        first, second, third = (
            height + offset for height, offset in zip(heights, machine.height_offsets)
        )
        return first, second, third

    in_space = replace(
        limits,
        lower_heights=true(limits.lower_heights),
        upper_heights=true(limits.upper_heights),
    )
    return Workspace(TriGlide(machine.geometry), in_space)


# One section for all nodes, as in config/tri_glide.yaml: so "-p name:=value" wins over it.
TEXT = """# Geometry of one machine, as it was calibrated. All nodes take it after their other file:
# --params-file tri_glide.yaml --params-file {name}
# In braces, so that a file that is cut off is refused.
/**: {{ros__parameters: {{
  geometry: calibrated,
  anchors: {anchors}, # m
  arm_lengths: {arm_lengths}, # m
  height_offsets: {height_offsets}{drawing} # m
}}}}
"""


def parameter_text(
    machine: MachineParameters, name: str, drawing: MachineParameters | None = None
) -> str:
    """Return the text of the file ``name`` for a ``machine``, with lengths to a nanometre.

    With its ``drawing``, about which the priors of the next calibration will be, too.
    """
    geometry = machine.geometry
    return TEXT.format(
        name=name,
        drawing="" if drawing is None else f",\n  drawn_machine: {list_text(drawing.vector, 9)}",
        anchors=list_text((number for anchor in geometry.anchors for number in anchor), 9),
        arm_lengths=list_text(geometry.arm_lengths, 9),
        height_offsets=list_text(machine.height_offsets, 9),
    )


def save_parameters(
    file: Path, machine: MachineParameters, drawing: MachineParameters | None = None
) -> None:
    """Write the file, as ``parameter_text``; an older one becomes ``NAME.bak``.

    Raises:
        SavingError: if that is not possible, or a file is there that was not written so.
    """
    try:
        replace_file(file, parameter_text(machine, file.name, drawing))
    except OSError as error:
        raise SavingError(f"{file} cannot be written: {error.strerror or error}") from error
