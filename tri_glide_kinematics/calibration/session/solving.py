"""From what a file of measurements holds to a calibration, and to what is measured next."""

from __future__ import annotations

from dataclasses import replace

from tri_glide_kinematics.calibration.fit import (
    Calibration,
    MachineParameters,
    MeasurementFile,
    Proposal,
)
from tri_glide_kinematics.calibration.fit.calibrate import calibrate
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3
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
