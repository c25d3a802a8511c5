"""The four lengths of a four-bar linkage: checked, scaled, and with their change points found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from tri_glide_kinematics.checks import finite, positive
from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.mechanisms.errors import NotAssemblableError

# The loop is closed with the longest link as unit: lengths may be larger than other numbers [m].
LARGEST = 1e152

LINK_NAMES = ("crank", "coupler", "rocker", "ground")


@dataclass(frozen=True)
class LinkLengths:
    """Lengths of the four links of a linkage that can be assembled and moved.

    Attributes:
        crank: crank pivot to crank pin, in [m].
        coupler: crank pin to rocker pin, in [m].
        rocker: rocker pivot to rocker pin, in [m].
        ground: crank pivot to rocker pivot, in [m].
        tolerance: sums of two lengths that differ by no more than this part of the longest link
            count as equal, which makes the linkage a change-point linkage. From 0 to 1e-3.
    """

    crank: float
    coupler: float
    rocker: float
    ground: float
    tolerance: float = 1e-12

    def __post_init__(self) -> None:
        """Check the lengths.

        Raises:
            NotFiniteError: if a number is NaN or infinite.
            OutOfBoundsError: if a length is not positive, or is zero within the tolerance, or above
                ``LARGEST``, or the tolerance is not in its bounds.
            NotAssemblableError: if the longest link is as long as the other three together.
        """
        for name in LINK_NAMES:
            object.__setattr__(self, name, positive(name, getattr(self, name), "m", LARGEST))
        if not 0.0 <= finite("tolerance", self.tolerance) <= 1e-3:
            raise OutOfBoundsError("tolerance", self.tolerance, "from 0 to 1e-3")
        least = 4.0 * self.tolerance * self.longest
        for name in LINK_NAMES:
            if getattr(self, name) < least:
                bound = f"at least {least:.9g}, 4 times the tolerance of the longest link,"
                raise OutOfBoundsError(name, getattr(self, name), bound, "m")
        longest = max(LINK_NAMES, key=lambda name: float(getattr(self, name)))
        rest = sum(getattr(self, name) for name in LINK_NAMES if name != longest)
        if rest - self.longest <= self.tolerance * self.longest:
            raise NotAssemblableError(longest, self.longest, rest)

    @cached_property
    def longest(self) -> float:
        """Length of the longest link, in [m]."""
        return max(self.crank, self.coupler, self.rocker, self.ground)

    @cached_property
    def stretches(self) -> bool:
        """Whether coupler and rocker are just stretched when the crank points away from the ground.

        This is the change point at half a turn: crank + ground = coupler + rocker.
        """
        difference = self.coupler + self.rocker - self.crank - self.ground
        return abs(difference) <= self.tolerance * self.longest

    @cached_property
    def folds(self) -> bool:
        """Whether coupler and rocker just lie on each other when the crank lies on the ground.

        This is the change point at zero: abs(crank - ground) = abs(coupler - rocker).
        """
        difference = abs(self.coupler - self.rocker) - abs(self.crank - self.ground)
        return abs(difference) <= self.tolerance * self.longest

    @property
    def has_change_point(self) -> bool:
        """Whether all four joints come to lie on one line."""
        return self.stretches or self.folds

    @cached_property
    def scaled(self) -> tuple[float, float, float, float]:
        """Crank, coupler, rocker, ground over the longest link, with their change points exact.

        A linkage passes a change point smoothly only if its joints come to lie on one line exactly,
        which rounded lengths miss. So coupler and rocker (and the ground, if it equals the crank)
        give way by at most the tolerance.
        """
        a, b, c, d = (float(getattr(self, name)) / self.longest for name in LINK_NAMES)
        if self.folds and abs(a - d) <= self.tolerance:
            d = a
        total = a + d if self.stretches else b + c
        difference = math.copysign(abs(a - d), b - c) if self.folds else b - c
        if self.has_change_point:
            b, c = 0.5 * (total + difference), 0.5 * (total - difference)
        return a, b, c, d

    @cached_property
    def stretched_gap(self) -> float:
        """(coupler + rocker)^2 - (crank + ground)^2, the longest link being 1.

        Negative if the crank cannot point away from the rocker pivot; zero at a change point.
        """
        a, b, c, d = self.scaled
        return 0.0 if self.stretches else (b + c - a - d) * (a + b + c + d)

    @cached_property
    def folded_gap(self) -> float:
        """(crank - ground)^2 - (coupler - rocker)^2, the longest link being 1.

        Negative if the crank cannot point to the rocker pivot; zero at a change point.
        """
        a, b, c, d = self.scaled
        return 0.0 if self.folds else (d - a + b - c) * (d - a - b + c)
