"""Where a fit begins: the nominal machine, and plates and frames as it would have seen them."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.calibration.fit.measurements import MeasuredPosition, Touch
from tri_glide_kinematics.calibration.fit.model import MeasurementModel, positions_of
from tri_glide_kinematics.calibration.fit.unknowns import FramePlacement, State, plate_numbers
from tri_glide_kinematics.vectors import FloatArray


def starting_state(model: MeasurementModel, machine: FloatArray) -> State:
    """Return the state with this machine and the plates and frames that fit it best.

    Args:
        model: of the measurements.
        machine: the twelve parameters [m]. It has to reach all that was measured.
    """
    touches: dict[str, list[Touch]] = {}
    positions: dict[str, list[MeasuredPosition]] = {}
    for one in model.measurements:
        if isinstance(one, Touch):
            touches.setdefault(one.plate.name, []).append(one)
        elif isinstance(one, MeasuredPosition) and one.frame in model.unknowns.frames:
            positions.setdefault(one.frame, []).append(one)
    plates, frames = {}, {}
    for name, some in touches.items():
        places = positions_of(machine, np.array([touch.heights for touch in some]))
        surface = plate_numbers(some[0].plate)
        free = np.array(model.unknowns.plates[name]) >= 0
        factors = np.column_stack((np.ones(len(places)), places[:, :2]))
        surface[free] = np.linalg.lstsq(
            factors[:, free], places[:, 2] - factors @ surface, rcond=None
        )[0]
        plates[name] = surface
    for name, seen in positions.items():
        places = positions_of(machine, np.array([one.heights for one in seen]))
        frames[name] = placement(places, np.array([one.position for one in seen]))
    return State(machine, plates, frames)


def placement(places: FloatArray, seen: FloatArray) -> FramePlacement:
    """Return the turn and shift that bring ``places`` to where they were ``seen`` (Kabsch).

    Args:
        places: in the frame of the machine. Shape (n, 3) [m].
        seen: the same in the other frame. Shape (n, 3) [m].
    """
    center, seen_center = places.mean(axis=0), seen.mean(axis=0)
    left, _, right = np.linalg.svd((seen - seen_center).T @ (places - center))
    # A reflection fits places in one plane as well as a turn does: it is none.
    signs = np.array([1.0, 1.0, np.linalg.det(left) * np.linalg.det(right)])
    rotation = (left * signs) @ right
    return FramePlacement(rotation, seen_center - rotation @ center)
