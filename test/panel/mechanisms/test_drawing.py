"""Fit: a mechanism of any size at a good size, which stays while a length is being changed."""

import numpy as np
import pytest

from tri_glide_kinematics.panel.mechanisms.tab import fitted

BOX = np.array([[-0.02, 0.01], [0.06, 0.05]])


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_the_larger_side_gets_the_size_and_the_middle_lies_in_the_centre(factor):
    box = BOX * factor
    fit = fitted(box, 0.7, None)
    drawn = fit(box)
    assert drawn.shape == (2, 3)
    assert (drawn[1] - drawn[0])[:2] == pytest.approx([0.7, 0.35])
    assert drawn.mean(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)


def test_a_fit_is_kept_until_the_drawing_is_too_large_or_too_small():
    fit = fitted(BOX, 0.7, None)
    assert fitted(BOX * 1.05, 0.7, fit) is fit
    assert fitted(BOX * 0.8, 0.7, fit) is fit
    middle = BOX.mean(axis=0)
    for factor in (1.25, 0.4):
        box = middle + factor * (BOX - middle)
        other = fitted(box, 0.7, fit)
        assert other is not fit
        assert np.ptp(other(box)[:, 0]) == pytest.approx(0.7)
    # Far from where it was, though as large.
    assert fitted(BOX + 1.0, 0.7, fit) is not fit


def test_lines_keep_their_shape():
    fit = fitted(BOX, 0.7, None)
    assert fit(np.zeros((5, 2, 2))).shape == (5, 2, 3)
    assert fit(np.empty((0, 2, 2))).shape == (0, 2, 3)
