import random
from fractions import Fraction

import pytest
from soak import many, seed

from tri_glide_kinematics.drives import DriveUnits
from tri_glide_kinematics.errors import OutOfBoundsError


def test_counts_and_heights_are_exact_with_any_gear():
    """Also near 32 bits, where products of floats lose counts."""
    rng = random.Random(seed(1))
    for _ in range(many(3000)):
        counts = rng.randint(2**31, 2**32)
        units = DriveUnits(counts, rng.randint(2**28, 2**32), rng.choice((1, -1)))
        zero = rng.uniform(-1.0, 1.0)
        count = rng.randint(-(2**31) + 1, 2**31 - 1)
        height = units.height_of(count, zero)
        exact = Fraction(zero) + units.direction * count / units.per_metre
        assert height == float(exact)
        wanted = units.direction * (Fraction(height) - Fraction(zero)) * units.per_metre
        assert abs(units.counts_of(height, zero) - wanted) <= Fraction(1, 2)


def test_what_is_no_gear_or_has_no_count_is_refused():
    for counts, per, way in ((0, 1, 1), (1, 2**32 + 1, 1), (1, 1, 0)):
        with pytest.raises(OutOfBoundsError):
            DriveUnits(counts, per, way)
    with pytest.raises(OutOfBoundsError, match="within 2147483647 counts"):
        DriveUnits(2**32, 1).counts_of(1.0, 0.0)
