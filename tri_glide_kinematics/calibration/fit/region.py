"""The part of the workspace over which a calibration looks at the platform's position.

How far a position is off does not depend on z, as sliders and arms only move up and down together
along it. So the region is a disc in x and y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tri_glide_kinematics.calibration.fit.model import position_derivatives
from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray

# Radius of the disc as part of the distance of the anchors from their centre: at 200 mm, 120 mm.
PART = 0.6


@dataclass(frozen=True, eq=False)
class Region:
    """A disc, and places that are evenly spread over it.

    Attributes:
        center: x, y [m].
        radius: [m].
        places: x, y and 0. Shape (n, 3) [m].
    """

    center: tuple[float, float]
    radius: float
    places: FloatArray

    @classmethod
    def disc(cls, center: tuple[float, float], radius: float, rings: int = 5) -> Region:
        """Return a disc with one place at its centre and ``rings`` around it."""
        rows = [(center[0], center[1], 0.0)]
        for ring in range(1, rings + 1):
            # Six more in each ring than in the one before: each place stands for the same area.
            for k in range(6 * ring):
                angle, distance = math.tau * k / (6 * ring), radius * ring / rings
                rows.append(
                    (
                        center[0] + distance * math.cos(angle),
                        center[1] + distance * math.sin(angle),
                        0.0,
                    )
                )
        return cls(center, radius, np.array(rows))

    @classmethod
    def of(cls, geometry: TriGlideGeometry) -> Region:
        """Return the region of a machine: the disc about the centre of its anchors.

        It is made smaller where an arm would not reach that far.
        """
        anchors = np.array(geometry.anchors)
        center = anchors.mean(axis=0)
        distances = np.linalg.norm(anchors - center, axis=1)
        reach = (np.array(geometry.arm_lengths) - distances).min()
        radius = min(PART * float(distances.mean()), 0.9 * float(reach))
        return cls.disc((float(center[0]), float(center[1])), max(radius, 0.0))

    def derivatives(self, machine: FloatArray) -> FloatArray:
        """Return the derivatives of the position at each place. Shape (n, 3, 12)."""
        return position_derivatives(machine, self.places)

    def plane_motion(self, derivatives: FloatArray) -> FloatArray:
        """Return the shift in x and y and the turn about z that fit ``derivatives`` best.

        Args:
            derivatives: of the positions at the places. Shape (n, 3, m).

        Returns:
            Shape (3, m) [m, m, rad].
        """
        basis = plane_basis(self.places, self.center).reshape(-1, 3)
        rows = derivatives.reshape(len(basis), -1)
        return np.asarray(np.linalg.lstsq(basis, rows, rcond=None)[0])


def plane_basis(places: FloatArray, center: tuple[float, float]) -> FloatArray:
    """Return how places move with a shift in x, in y, and a turn about z. Shape (n, 3, 3)."""
    basis = np.zeros((len(places), 3, 3))
    basis[:, 0, 0] = basis[:, 1, 1] = 1.0
    basis[:, 0, 2] = center[1] - places[:, 1]
    basis[:, 1, 2] = places[:, 0] - center[0]
    return basis
