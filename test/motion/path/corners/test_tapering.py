"""Roundings of corners that stand alone: their form, their tolerance, the room they use."""

import numpy as np
import pytest

from testing.path_samples import random_path
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path.corners import corrections
from tri_glide_kinematics.motion.path.corners.widths import WIDEST

TOLERANCE = 1e-3


def corner(before, after):
    """Return a right angle between two lines [m], as it is driven."""
    return PlatformPath.through([(0, 0, 0), (before, 0, 0), (before, after, 0)], TOLERANCE).driven


def quartic(x, width):
    return width / 8.0 * np.maximum(1.0 - np.abs(x) / width, 0.0) ** 4


def cubic(x, width):
    return width / 6.0 * np.maximum(1.0 - np.abs(x) / width, 0.0) ** 3


@pytest.mark.parametrize("few_terms", [0, 4000])
@pytest.mark.parametrize("room", [0.004, 0.006, 0.0065, 0.0086, 0.012])
def test_the_form_is_that_of_the_formulas(room, few_terms, monkeypatch):
    monkeypatch.setattr(corrections, "FEW_TERMS", few_terms)
    monkeypatch.setattr(corrections, "FEW_EACH", 0)
    driven = corner(0.012, room)
    width = min(room, WIDEST * TOLERANCE)
    x = np.linspace(-0.012, room, 500)[:-1]
    wide = 0.75 * quartic(x, width) + 0.3 * quartic(x, 0.6 * width)
    wide -= 0.05 * quartic(x, 0.2 * width)
    hat = cubic(x, width)
    # So much of the wide one that the height is that of the tolerance.
    part = 0.0
    if width > 6.0 * TOLERANCE:
        part = (width / 6.0 - TOLERANCE) / (width / 6.0 - 0.115 * width)
    expected = (1.0 - part) * hat + part * wide
    places = driven.derivatives(0.012 + x, 0)[0]
    programmed = np.column_stack((0.012 + np.minimum(x, 0.0), np.maximum(x, 0.0), 0.0 * x))
    jump = np.array([-1.0, 1.0, 0.0])
    assert places - programmed == pytest.approx(expected[:, np.newaxis] * jump, abs=1e-11)
    assert driven.widths.tapers == pytest.approx([part], abs=1e-8)
    assert driven.deviation_bound == pytest.approx(min(TOLERANCE, width / 6.0), rel=1e-8)


def test_the_third_derivative_is_small_in_the_middle_and_falls_to_zero_at_the_end():
    driven = corner(0.012, 0.012)
    width = driven.widths.half_widths[0]
    ways = 0.012 + width * np.array([0.0, 0.1, 0.2, 0.6, 0.999])
    thirds = np.abs(driven.derivatives(ways)[3, :, 0]) * width**2
    expected = np.array([1.0, 67.0 / 30.0, 52.0 / 15.0, 0.9, 0.00225])
    assert thirds == pytest.approx(expected, abs=1e-6)


def test_each_takes_half_of_the_room_between_and_what_the_other_leaves():
    def widths(length, tolerances):
        path = PlatformPath.start((0, 0, 0)).line_to((0.1, 0, 0), tolerances[0])
        path = path.line_to((0.1, length, 0), tolerances[1]).line_to((0.2, length, 0))
        return path.driven.widths.half_widths

    assert widths(0.013, (1e-3, 1e-3)) == pytest.approx([0.0065, 0.0065])
    assert widths(0.0173, (1e-3, 1e-3)) == pytest.approx([0.00865] * 2)
    assert widths(0.009, (1e-3, 1e-4))[0] == pytest.approx(0.009 - WIDEST * 1e-4)
    # With less room than for two hats, there is none to taper off.
    assert widths(0.0115, (1e-3, 1e-3)).max() < 0.006


def test_no_rounding_that_tapers_off_overlaps_another():
    rng = np.random.default_rng(1)
    found = 0
    for _ in range(60):
        driven = random_path(rng, arcs=0.2)[0].driven
        ways, (half_widths, _, _, tapers, swings, _) = driven.rounded.ways, driven.widths
        assert (tapers >= 0.0).all() and (tapers <= 1.0).all()
        free = np.diff(ways) - half_widths[1:] - half_widths[:-1]
        beside = (tapers[1:] > 0.0) | (tapers[:-1] > 0.0)
        beside &= (swings[1:] == 0.0) & (swings[:-1] == 0.0)
        assert (free[beside] >= -1e-12).all()
        assert (half_widths <= driven.rounded.rooms * (1.0 + 1e-12)).all()
        assert (driven.rounded.bends[tapers > 0.0] == 0.0).all()
        found += np.count_nonzero(beside)
    assert found > 40
