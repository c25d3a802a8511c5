r"""A parameter of a path in which a motion that begins or ends at rest is regular.

After rest with constant jerk the way grows with the third power of time, and its square of the
speed, as a function of the way, has an infinite slope there. So the way is a smooth function of a
parameter u. At an end at rest it is $s = w\,\Psi(u / w)$ with $\Psi' = 6x^2 - 8x^3 + 3x^4$ up to
$x = 1$, and of slope one behind that: three times continuously differentiable, monotone, and like
$2 x^3$ next to rest. The motion is then described by $b(u) = \dot u^2$, which is positive there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.vectors import FloatArray

# Way behind which the map has slope one, as a fraction of the width.
REACH = 0.6

# Newton's method for the parameter; from its starting value fewer are enough.
_NEWTON_STEPS = 6


class RestMap(NamedTuple):
    """Way over parameter, between two ends each of which may be at rest.

    Attributes:
        begin: where the way begins [m].
        end: where it ends [m].
        first: width of the map at the begin, 0 if that is in motion [m].
        last: width of the map at the end, 0 if that is in motion [m].
    """

    begin: float
    end: float
    first: float
    last: float

    @property
    def span(self) -> float:
        """Largest parameter [m]; the least is 0."""
        return self.end - self.begin + (1.0 - REACH) * (self.first + self.last)

    def parameters(self, ways: FloatArray) -> FloatArray:
        """Return the parameters of ``ways``. Shape (n,) [m]."""
        before, after = ways - self.begin, self.end - ways
        result = before + (1.0 - REACH) * self.first
        if self.first > 0.0:
            near = before < REACH * self.first
            result[near] = self.first * _inverse(before[near] / self.first)
        if self.last > 0.0:
            near = after < REACH * self.last
            result[near] = self.span - self.last * _inverse(after[near] / self.last)
        return np.asarray(result)

    def derivatives(self, parameters: FloatArray) -> FloatArray:
        """Return the way and three derivatives by the parameter. Shape (4, n)."""
        result = np.zeros((4, len(parameters)))
        result[0] = parameters + (self.begin - (1.0 - REACH) * self.first)
        result[1] = 1.0
        if self.first > 0.0:
            near = parameters < self.first
            result[:, near] = _scaled(parameters[near], self.first)
            result[0, near] += self.begin
        if self.last > 0.0:
            left = self.span - parameters
            near = left < self.last
            result[:, near] = _scaled(left[near], self.last)
            result[0, near] = self.end - result[0, near]
            result[2, near] *= -1.0
        return result


def _scaled(parameters: FloatArray, width: float) -> FloatArray:
    """Return the way from rest and its derivatives. Shape (4, n)."""
    x = parameters / width
    square = x * x
    return np.array(
        (
            width * square * x * (2.0 - 2.0 * x + 0.6 * square),
            square * (6.0 - 8.0 * x + 3.0 * square),
            12.0 * x * (1.0 - x) ** 2 / width,
            12.0 * (1.0 - x) * (1.0 - 3.0 * x) / width**2,
        )
    )


def _inverse(ways: FloatArray) -> FloatArray:
    """Return x with Psi(x) = ``ways`` between 0 and ``REACH``. Shape (n,)."""
    ways = np.maximum(ways, 0.0)
    x = np.cbrt(0.5 * ways)
    x = np.minimum(x * (1.0 + x * (1.0 / 3.0 + 0.4 * x * x)), 1.0)
    for _ in range(_NEWTON_STEPS):
        square = x * x
        slope = square * (6.0 - 8.0 * x + 3.0 * square)
        miss = square * x * (2.0 - 2.0 * x + 0.6 * square) - ways
        x = np.clip(x - miss / np.maximum(slope, 1e-300), 0.0, 1.0)
    return np.asarray(x)
