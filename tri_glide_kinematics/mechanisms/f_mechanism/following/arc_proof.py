"""How far the curve of positions is proven to be one arc: a tube about its tangent."""

from __future__ import annotations

import math
from typing import NamedTuple

from tri_glide_kinematics.mechanisms.f_mechanism.following.curve import Frame

# Change of the Jacobian that a tube allows at most; must stay below one.
LARGEST_CHANGE = 0.7
# Radius of a tube, as a multiple of the deviation of the curve from its tangent.
WIDTH = 3.0
# Where two turning points merge, the length of a tube is not reduced below this part.
SHORTEST = 1e-3


class Tube(NamedTuple):
    """A cylinder about the tangent in which the curve is one arc from end to end.

    Attributes:
        length: along the tangent.
        radius: across it.
        sure: whether it is proven that the drive reverses at most once in it.
    """

    length: float
    radius: float
    sure: bool


def tube(frame: Frame, longest: float) -> Tube:
    """Longest tube about the tangent of ``frame`` in which the curve is proven to be one arc.

    In a tube of length h and radius r the Jacobian across the curve deviates from the identity by
    no more than

        change = mixed h + across r + third (h^2 + r^2) / 2.

    Below one this makes the solution at each tangential coordinate unique. The slope of the arc is
    at most

        slope = (along h + mixed r + third (h^2 + r^2) / 2) / (1 - change),

    and its integral below r keeps the arc inside. The drive does not reverse while the slope is
    less than the slope of the tangent against planes of constant drive. Beside a turning point the
    second derivative of the drive keeps its sign instead, so that it reverses at most once.
    """
    across_drive = math.hypot(frame.normal_1[2], frame.normal_2[2])
    bend = abs(frame.normal_1[2] * frame.curvature[0] + frame.normal_2[2] * frame.curvature[1])
    length = min(
        longest,
        0.5 / (frame.mixed + 1e-300),
        math.sqrt(0.4 / (frame.across * frame.along + 1e-300)),
        math.sqrt(1.0 / (frame.third + 1e-300)),
    )
    widest = None
    while widest is None or length > SHORTEST * widest.length:
        radius = WIDTH * length * length * (0.5 * frame.along + length * frame.third / 6.0)
        square = length * length + radius * radius
        change = frame.mixed * length + frame.across * radius + 0.5 * frame.third * square
        drift = 0.5 * frame.along * length + frame.mixed * radius
        drift += frame.third * (length * length / 6.0 + 0.5 * radius * radius)
        if change < LARGEST_CHANGE and length * drift <= (1.0 - change) * radius:
            widest = widest or Tube(length, radius, False)
            slope = frame.along * length + frame.mixed * radius + 0.5 * frame.third * square
            slope /= 1.0 - change
            variation = (
                frame.third * math.sqrt(square) * (1.0 + slope * slope)
                + 2.0 * frame.mixed * slope
                + frame.across * slope * slope
                + change * frame.along
            ) / (1.0 - change)
            runs_on = slope * across_drive < abs(frame.tangent[2])
            if runs_on or variation * across_drive < bend:
                return Tube(length, radius, True)
        length *= 0.8
    return widest._replace(length=length)
