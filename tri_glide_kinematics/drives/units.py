"""What a drive counts, and the height of its slider: exact, whatever the gear."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from tri_glide_kinematics.errors import OutOfBoundsError

# Numerator and denominator of a gear are no larger: each fits into an object of a drive.
LARGEST_PART = 2**32

# Positions of a drive (objects 0x6064 and 0x607A) are integers of 32 bits.
LARGEST_COUNT = 2**31 - 1


@dataclass(frozen=True)
class DriveUnits:
    """How far a slider goes for each count of its drive.

    Attributes:
        counts: so many for ``per`` micrometres of way; both are whole, so no gear is rounded.
        per: micrometres.
        direction: +1 if the drive counts up when the slider goes up, otherwise -1.
    """

    counts: int
    per: int
    direction: int = 1

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            OutOfBoundsError: if a part of the fraction is not within 1 and 2**32, or the direction
                is neither +1 nor -1.
        """
        for name in ("counts", "per"):
            value = getattr(self, name)
            if not (isinstance(value, int) and 1 <= value <= LARGEST_PART):
                raise OutOfBoundsError(name, value, f"a whole number from 1 to {LARGEST_PART}")
        if self.direction not in (1, -1):
            raise OutOfBoundsError("direction", self.direction, "1 or -1")

    @property
    def per_metre(self) -> Fraction:
        """Counts for each metre, without a sign."""
        return Fraction(self.counts * 10**6, self.per)

    def counts_of(self, height: float, zero: float) -> int:
        """Return what the drive counts at a height.

        Args:
            height: of the slider [m].
            zero: height at which the drive counts 0 [m].

        Raises:
            OutOfBoundsError: if the drive has no number of 32 bits for it.
        """
        above, below = height.as_integer_ratio()
        zero_above, zero_below = zero.as_integer_ratio()
        way = (above * zero_below - zero_above * below) * self.counts * 10**6 * self.direction
        unit = below * zero_below * self.per
        count = (2 * way + unit) // (2 * unit)
        if abs(count) > LARGEST_COUNT:
            bound = f"within {LARGEST_COUNT} counts of the height {zero:g}"
            raise OutOfBoundsError("height", height, bound, "m")
        return count

    def height_of(self, count: int, zero: float) -> float:
        """Return the height at which the drive counts so far [m]; ``zero`` as above."""
        above, below = zero.as_integer_ratio()
        unit = self.counts * 10**6
        return (above * unit + self.direction * count * self.per * below) / (below * unit)

    def rate_of(self, rate: float, name: str = "speed or acceleration") -> int:
        """Return a velocity [m/s] or an acceleration in counts, at least 1, without the direction.

        Raises:
            OutOfBoundsError: if the drive has no number of 32 bits for it.
        """
        counts = round(rate * self.per_metre)
        if counts >= LARGEST_PART:
            raise OutOfBoundsError(name, rate, f"below {LARGEST_PART} counts of the drive")
        return max(1, counts)
