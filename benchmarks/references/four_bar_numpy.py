"""A four-bar sweep in numpy, written down straight from the textbook."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BranchMotion:
    """Motion of one branch over n crank angles.

    Attributes:
        pin_x: of the rocker pin. Shape (n,) [m].
        pin_y: of the rocker pin. Shape (n,) [m].
        coupler_velocity: Shape (n,) [rad/s].
        rocker_velocity: Shape (n,) [rad/s].
        coupler_acceleration: Shape (n,) [rad/s^2].
        rocker_acceleration: Shape (n,) [rad/s^2].
    """

    pin_x: Floats
    pin_y: Floats
    coupler_velocity: Floats
    rocker_velocity: Floats
    coupler_acceleration: Floats
    rocker_acceleration: Floats


def sweep(
    lengths: tuple[float, float, float, float], crank_angles: Floats, crank_velocity: float
) -> tuple[BranchMotion, BranchMotion]:
    """Return both branches for a crank that turns evenly.

    Args:
        lengths: crank, coupler, rocker, ground [m].
        crank_angles: from the ground link. Shape (n,) [rad].
        crank_velocity: [rad/s].
    """
    crank, coupler, rocker, ground = lengths
    # Where the circles about crank pin and rocker pivot meet.
    crank_x, crank_y = crank * np.cos(crank_angles), crank * np.sin(crank_angles)
    diagonal_x, diagonal_y = ground - crank_x, -crank_y
    squared = diagonal_x**2 + diagonal_y**2
    along = (squared + coupler**2 - rocker**2) / (2.0 * squared)
    across = np.sqrt(coupler**2 / squared - along**2)
    foot_x, foot_y = crank_x + along * diagonal_x, crank_y + along * diagonal_y
    first, second = (
        _motion(
            *(crank_x, crank_y, ground, crank_velocity),
            *(foot_x - side * across * diagonal_y, foot_y + side * across * diagonal_x),
        )
        for side in (1.0, -1.0)
    )
    return first, second


def _motion(
    crank_x: Floats, crank_y: Floats, ground: float, velocity: float, pin_x: Floats, pin_y: Floats
) -> BranchMotion:
    """Return one branch, given its rocker pin, by the derivatives of crank + coupler = rocker."""
    coupler_x, coupler_y = pin_x - crank_x, pin_y - crank_y
    rocker_x, rocker_y = pin_x - ground, pin_y
    determinant = coupler_x * rocker_y - coupler_y * rocker_x
    coupler_velocity = -velocity * (crank_x * rocker_y - crank_y * rocker_x) / determinant
    rocker_velocity = velocity * (coupler_x * crank_y - coupler_y * crank_x) / determinant
    right_x = velocity**2 * crank_x + coupler_velocity**2 * coupler_x
    right_y = velocity**2 * crank_y + coupler_velocity**2 * coupler_y
    right_x -= rocker_velocity**2 * rocker_x
    right_y -= rocker_velocity**2 * rocker_y
    return BranchMotion(
        *(pin_x, pin_y, coupler_velocity, rocker_velocity),
        (right_x * rocker_x + right_y * rocker_y) / determinant,
        (right_x * coupler_x + right_y * coupler_y) / determinant,
    )
