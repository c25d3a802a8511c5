"""Makes what a calibration starts from of the values of parameters. No ROS in here.

Not beside the others, as a node that moves the machine need not load any of it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from tri_glide_kinematics.calibration.fit import MachineParameters, Plate, Priors
from tri_glide_kinematics.calibration.session import Deviations, ProbeSettings, SavingError
from tri_glide_kinematics.ros.parameters.table import Values
from tri_glide_kinematics.ros.parameters.tables import CALIBRATION_NODE
from tri_glide_kinematics.ros.parameters.values import machine_of, workspace_limits_of
from tri_glide_kinematics.workspace import WorkspaceLimits


def nominal_of(values: Values) -> MachineParameters:
    """Return the machine as it is believed to be.

    Raises:
        KinematicsError: if no working machine has this geometry.
    """
    return MachineParameters(machine_of(values).geometry, values["height_offsets"])


def folder_of(values: Values) -> Path:
    """Return the folder of all files that services name.

    Raises:
        SavingError: if there is no such folder.
    """
    folder = Path(values["folder"]).expanduser().resolve()
    if not folder.is_dir():
        raise SavingError(f"folder = {values['folder']!r}: {folder} is no folder")
    return folder


def plate_of(values: Values) -> Plate:
    """Return the plate that is touched, with what is known of it."""
    known = values["plate_known"]
    height = values["plate_height"] if known == "height_and_tilt" else None
    tilt = None if known == "nothing" else values["plate_tilt"]
    return Plate(values["plate_name"], height, tilt)


def priors_of(values: Values) -> Priors | None:
    """Return how far a machine may be from its parameters; None if that is not known."""
    if not values["use_priors"]:
        return None
    return Priors(
        values["prior_anchors"], values["prior_arm_lengths"], values["prior_height_offsets"]
    )


def reported_workspace_of(values: Values) -> WorkspaceLimits:
    """Return where the platform may be, with the travel of the sliders as the drives report it.

    Raises:
        KinematicsError: if two bounds are not in order.
    """
    return workspace_limits_of({**values, "height_offsets": (0.0, 0.0, 0.0)})


def deviations_of(values: Values) -> Deviations:
    """Return the standard deviations of measurements that come without one."""
    return Deviations(
        values["touch_deviation"], values["position_deviation"], values["distance_deviation"]
    )


def probe_settings_of(values: Values, depth: float = 0.0, speed: float = 0.0) -> ProbeSettings:
    """Return how to probe; a ``depth`` [m] or ``speed`` [m/s] of zero is that of the values.

    Raises:
        KinematicsError: if one is outside the bounds of its parameter.
    """
    return ProbeSettings(
        requested("speed", speed, "probe_speed") or values["probe_speed"],
        requested("depth", depth, "probe_depth") or values["probe_depth"],
        values["contact_timeout"],
    )


def requested(name: str, value: float, parameter: str) -> float:
    """Return the ``value`` of a request; 0 stands for what the node has been told.

    Raises:
        KinematicsError: if it is outside the bounds of the ``parameter`` that it takes the place
            of; the text gives it the ``name`` that it has in the request.
    """
    entry = next(one for one in CALIBRATION_NODE if one.name == parameter)
    return value if value == 0.0 else float(replace(entry, name=name).checked(value))
