import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import reproducible

from tri_glide_kinematics.motion.trajectory import StraightLine
from tri_glide_kinematics.tri_glide import (
    DEFAULT_GEOMETRY,
    ArmTooShortError,
    TriGlide,
    TriGlideGeometry,
)

UNEQUAL = TriGlideGeometry(((0.01, 0.21), (-0.18, -0.09), (0.165, -0.11)), (0.40, 0.42, 0.385))
PLACES = st.tuples(*(st.floats(low, high) for low, high in ((-0.1, 0.1), (-0.1, 0.1), (0.0, 0.6))))
GEOMETRIES = st.sampled_from((DEFAULT_GEOMETRY, UNEQUAL))


def differences(values, step):
    return (values[:, 2:] - values[:, :-2]) / (2.0 * step)


@reproducible
@given(GEOMETRIES, PLACES, PLACES)
def test_heights_are_those_of_the_inverse_kinematics(geometry, start, end):
    if np.linalg.norm(np.subtract(start, end)) < 1e-6:
        return
    line = StraightLine.between(geometry, start, end)
    ways = np.linspace(0.0, line.length, 17)
    expected = [TriGlide(geometry).inverse(line.point(way)) for way in ways.tolist()]
    assert np.allclose(line.derivatives(ways).heights[0].T, expected, rtol=0.0, atol=1e-13)
    assert np.allclose([line.heights_at(way) for way in ways.tolist()], expected, atol=1e-13)
    assert np.allclose(line.start_heights, expected[0], rtol=0.0, atol=1e-13)
    assert np.allclose(line.point(line.length), end, rtol=0.0, atol=1e-12)


@reproducible
@given(GEOMETRIES, PLACES, PLACES)
def test_derivatives_are_those_of_the_heights(geometry, start, end):
    if np.linalg.norm(np.subtract(start, end)) < 1e-3:
        return
    line = StraightLine.between(geometry, start, end)
    ways = np.linspace(0.0, line.length, 2001)
    step = ways[1]
    (heights, first, second, third), rates = line.derivatives(ways)
    assert (rates == 1.0).all()
    # The error of a central difference is a sixth of the third derivative times the step squared.
    for lower, higher in ((heights, first), (first, second), (second, third)):
        scale = 1.0 + np.abs(higher).max()
        assert np.abs(differences(lower, step) - higher[:, 1:-1]).max() < 1e-3 * scale
    assert np.allclose(line.start_slopes, first[:, 0])
    assert np.allclose(line.start_bends, second[:, 0])


def test_rise_is_concave_along_any_line():
    """The bounds of what the sliders do rely on it."""
    rng = np.random.default_rng(2)
    for _ in range(200):
        start, end = rng.uniform((-0.1, -0.1, 0.0), (0.1, 0.1, 0.6), (2, 3)).tolist()
        line = StraightLine.between(UNEQUAL, start, end)
        assert (line.derivatives(np.linspace(0.0, line.length, 50)).heights[2] <= 0.0).all()


def test_line_out_of_reach_names_arm_and_place():
    with pytest.raises(ArmTooShortError) as caught:
        StraightLine.between(DEFAULT_GEOMETRY, (0.0, 0.0, 0.3), (0.0, -0.3, 0.3))
    assert caught.value.arm == 0
    assert caught.value.position == pytest.approx((0.0, -0.3, 0.3))
    assert caught.value.distance == pytest.approx(0.5)
    with pytest.raises(ArmTooShortError) as caught:
        StraightLine(DEFAULT_GEOMETRY, (0.0, -0.3, 0.3), (0.0, 1.0, 0.0), 0.1)
    assert caught.value.position == pytest.approx((0.0, -0.3, 0.3))
    line = StraightLine(DEFAULT_GEOMETRY, (0.0, 0.0, 0.3), (0.0, -1.0, 0.0), 0.0)
    with pytest.raises(ArmTooShortError):
        line.heights_at(0.3)
