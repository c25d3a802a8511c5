"""A machine that is not as it was drawn, by chance."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.calibration.fit.machine import MachineParameters
from tri_glide_kinematics.calibration.fit.priors import Priors
from tri_glide_kinematics.tri_glide.geometry import DEFAULT_GEOMETRY

NOMINAL = MachineParameters(DEFAULT_GEOMETRY)
# How far machines are from their drawing, and what is assumed of this one (standard deviations).
USUAL_ERRORS = Priors(anchors=5e-4, arm_lengths=3e-4, height_offsets=1e-3)


def wrong_machine(seed: int) -> MachineParameters:
    """Return one of many machines that were all built to the drawing of the default one."""
    deviations = USUAL_ERRORS.deviations()
    change = deviations * np.random.default_rng(seed).standard_normal(len(deviations))
    return MachineParameters.from_vector(NOMINAL.vector + change)
