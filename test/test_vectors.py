"""Arrays of numbers as sets."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from soak import many
from strategies import reproducible

from tri_glide_kinematics.vectors import are_among, ascending

few_examples = settings(reproducible, max_examples=many(60))
# Few different numbers, so that many come twice.
PARTS = arrays(float, st.integers(0, 8), elements=st.sampled_from([-1.5, -0.0, 0.0, 1e-300, 2.0]))


@few_examples
@given(PARTS)
def test_it_returns_what_unique_of_numpy_returns(numbers):
    np.testing.assert_array_equal(ascending(numbers), np.unique(numbers))


@few_examples
@given(PARTS, PARTS)
def test_it_finds_what_isin_of_numpy_finds(numbers, others):
    others = np.sort(others)
    np.testing.assert_array_equal(are_among(numbers, others), np.isin(numbers, others))
