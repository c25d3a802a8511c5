"""Machines that are not as they were drawn, and what is measured on them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tri_glide_kinematics.calibration.fit import (
    Distance,
    MachineParameters,
    MeasuredPosition,
    Plate,
    Priors,
    Region,
    Touch,
    plane_basis,
    positions_of,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3

NOMINAL = MachineParameters(DEFAULT_GEOMETRY)
# How far a machine is from its drawing (standard deviations) [m].
WRONG_BY = Priors(5e-4, 3e-4, 1e-3, common_radius=0.0, common_arm_length=0.0)
RADIUS = 0.12  # m, of the disc in which is measured
TOUCH, DISTANCE, POSITION = 1e-5, 5e-5, 5e-5  # standard deviations [m]


def ring(radius: float, count: int, first: float = 0.0) -> list[tuple[float, float]]:
    """Return ``count`` places on a circle, one of them at the angle ``first`` [m]."""
    angles = [first + math.tau * k / count for k in range(count)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


# Thirteen places in the disc [m]: twice in the middle and eleven times on the rim, as errors of a
# height are about a quadratic function of x and y; or in rings, as they are often spread.
PLACES = (*[(0.0, 0.0)] * 2, *ring(RADIUS, 11, 0.5))
IN_RINGS = ((0.0, 0.0), *ring(RADIUS / 2.0, 6), *ring(RADIUS, 6, 0.5))
REGION = Region.disc((0.0, 0.0), RADIUS, 3)


@dataclass(frozen=True)
class WrongMachine:
    """A machine as it really is; its methods measure on it, with noise.

    Attributes:
        parameters: the true ones.
    """

    parameters: MachineParameters

    @classmethod
    def random(cls, rng: np.random.Generator, nominal: MachineParameters = NOMINAL) -> WrongMachine:
        """Return a machine that is ``WRONG_BY`` as much from the ``nominal`` one."""
        change = WRONG_BY.deviations() * rng.standard_normal(12)
        return cls(MachineParameters.from_vector(nominal.vector + change))

    def reported(self, place: Sequence[float]) -> Vector3:
        """Return the heights that are reported when the platform is at a place. Shape (3,) [m]."""
        first, second, third = TriGlide(self.parameters.geometry).inverse(place)
        a, b, c = self.parameters.height_offsets
        return first - a, second - b, third - c

    def touch(
        self,
        x: float,
        y: float,
        rng: np.random.Generator,
        plate: Plate | None = None,
        surface: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> Touch:
        """Touch a ``plate`` whose true height and slopes are ``surface``."""
        z = surface[0] + surface[1] * x + surface[2] * y + TOUCH * rng.standard_normal()
        return Touch(self.reported((x, y, z)), plate or Plate(), TOUCH)

    def distance(
        self, start: Sequence[float], end: Sequence[float], rng: np.random.Generator
    ) -> Distance:
        """Measure the distance between two places."""
        length = math.dist(start, end) + DISTANCE * rng.standard_normal()
        return Distance(self.reported(start), self.reported(end), length, DISTANCE)

    def position(
        self, place: Sequence[float], rng: np.random.Generator, frame: str = "base"
    ) -> MeasuredPosition:
        """Measure a place in the frame of the machine."""
        x, y, z = (np.array(place) + POSITION * rng.standard_normal(3)).tolist()
        return MeasuredPosition(self.reported(place), (x, y, z), frame, POSITION)

    def touches(self, rng: np.random.Generator, places: ArrayLike = PLACES) -> list[Touch]:
        """Touch the known plate at some places."""
        return [self.touch(x, y, rng) for x, y in np.asarray(places).tolist()]

    def one_distance(self, rng: np.random.Generator) -> list[Distance]:
        """Measure one distance of 240 mm across the disc."""
        return [self.distance((-RADIUS, 0.0, 0.0), (RADIUS, 0.0, 0.0), rng)]

    def errors(self, believed: MachineParameters) -> FloatArray:
        """Return where a node with other parameters is wrong, in all places of the disc.

        A shift in x and y and a turn about z of all of them are taken out.

        Returns:
            Believed minus true position. Shape (37, 3) [m].
        """
        places = REGION.places
        heights = TriGlide(self.parameters.geometry).inverse_batch(places)
        errors = positions_of(believed.vector, heights - self.parameters.height_offsets) - places
        motion = REGION.plane_motion(errors[:, :, None])[:, 0]
        return np.asarray(errors - plane_basis(places, REGION.center) @ motion)


def drawn(seed: int) -> tuple[WrongMachine, np.random.Generator]:
    """Return a machine at random, and the source of chance for what is measured on it."""
    rng = np.random.default_rng(seed)
    return WrongMachine.random(rng), rng
