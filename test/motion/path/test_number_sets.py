"""Arrays of numbers as sets."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tri_glide_kinematics.motion.path import are_among
from tri_glide_kinematics.motion.path.number_sets import distinct

# Few different numbers, so that many come twice.
PARTS = arrays(float, st.integers(0, 8), elements=st.sampled_from([-1.5, -0.0, 0.0, 1e-300, 2.0]))


@given(PARTS, PARTS)
def test_it_returns_what_unique_of_numpy_returns(first, second):
    if len(first) + len(second):
        expected = np.unique(np.concatenate((first, second)))
        np.testing.assert_array_equal(distinct(first, second), expected)


@given(PARTS, PARTS)
def test_it_finds_what_isin_of_numpy_finds(numbers, others):
    others = np.sort(others)
    np.testing.assert_array_equal(are_among(numbers, others), np.isin(numbers, others))
