"""Modes that differ from place to place: the interpolation, and the shaper that is chosen."""

import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import reproducible

from tri_glide_kinematics.errors import KinematicsError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperByPlace, ShaperKind, residual

KINDS = list(ShaperKind)
RANDOM = st.builds(random.Random, st.integers(0, 10**6))
MIDDLE = (0.0, 0.0, 0.25)
LEFT, RIGHT = (-0.1, 0.0, 0.25), (0.1, 0.0, 0.25)


def by_place(*known, kind=ShaperKind.EI) -> ShaperByPlace:
    """Return what chooses shapers, for pairs of a place and its frequencies [Hz]."""
    places, modes = [], []
    for place, *frequencies in known:
        places.append(place)
        modes.append(tuple(Mode(frequency, 0.03) for frequency in frequencies))
    return ShaperByPlace(kind, tuple(places), tuple(modes))


def some_places(rng, count: int) -> list[tuple[float, float, float]]:
    """Return places at random, of which none is near to another."""
    places: list[tuple[float, float, float]] = []
    while len(places) < count:
        place = (rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(0.2, 0.4))
        if all(math.dist(place, other) > 0.01 for other in places):
            places.append(place)
    return places


def frequencies(chooser: ShaperByPlace, places) -> np.ndarray:
    return chooser.modes_at(np.array(places))[0, 0]


@given(RANDOM, st.integers(1, 12))
@reproducible
def test_at_a_known_place_its_own_modes_hold_and_elsewhere_none_beyond_all(rng, count):
    known = [(p, rng.uniform(8.0, 30.0), rng.uniform(30.0, 60.0)) for p in some_places(rng, count)]
    chooser = by_place(*known)
    there = chooser.modes_at(np.array(chooser.places))
    assert there.shape == (2, 2, count)
    np.testing.assert_allclose(there[0].T, [pair[1:] for pair in known], rtol=1e-9)
    np.testing.assert_allclose(there[1], 0.03, rtol=1e-9)
    anywhere = chooser.modes_at(np.array(some_places(rng, 30)) * 3.0)
    for each in range(2):
        assert anywhere[0, each].min() >= there[0, each].min() - 1e-9
        assert anywhere[0, each].max() <= there[0, each].max() + 1e-9


@given(RANDOM)
@reproducible
def test_one_place_is_everywhere(rng):
    chooser = by_place((MIDDLE, 15.0))
    assert frequencies(chooser, some_places(rng, 5)) == pytest.approx([15.0] * 5, rel=1e-12)


def test_between_two_places_a_frequency_changes_evenly_and_not_across():
    chooser = by_place((LEFT, 10.0), (RIGHT, 20.0))
    along = [(x, 0.0, 0.25) for x in np.linspace(-0.1, 0.1, 9)]
    expected = np.linspace(10.0, 20.0, 9)
    assert frequencies(chooser, along) == pytest.approx(expected, rel=1e-9)
    beside = [(x, 0.07, 0.35) for x in np.linspace(-0.1, 0.1, 9)]
    assert frequencies(chooser, beside) == pytest.approx(expected, rel=0.03)
    assert frequencies(chooser, [(0.3, 0.0, 0.25)]) == pytest.approx([20.0])


@given(RANDOM, st.integers(8, 14))
@reproducible
def test_what_changes_evenly_is_known_between_some_places(rng, count):
    gradient = np.array([rng.uniform(-20.0, 20.0) for _ in range(3)])
    known = some_places(rng, count)
    truth = 20.0 + (np.array(known) - MIDDLE) @ gradient
    chooser = by_place(*zip(known, truth.tolist()))
    weights = np.array([[rng.random() for _ in known] for _ in range(20)])
    between = weights / weights.sum(axis=1, keepdims=True) @ np.array(known)
    expected = 20.0 + (between - MIDDLE) @ gradient
    assert frequencies(chooser, between) == pytest.approx(expected, rel=0.03)


def test_places_nearly_in_a_plane_say_little_across_it():
    """A percent that differs over a millimetre of height is not a slope for all heights."""
    corners = [(x, y, 0.25) for x in (-0.1, 0.1) for y in (-0.1, 0.1)]
    chooser = by_place(*((place, 15.0) for place in corners), ((0.0, 0.0, 0.251), 15.15))
    assert frequencies(chooser, [(0.05, 0.05, 0.255)]) == pytest.approx([15.0], abs=0.1)


@given(RANDOM, st.sampled_from(KINDS), st.floats(0.0, 0.3))
@reproducible
def test_one_place_has_the_shaper_that_was_asked_for(rng, kind, damping):
    mode = Mode(rng.uniform(2.0, 400.0), damping)
    chooser = ShaperByPlace(kind, (MIDDLE,), ((mode,),))
    for places in (None, np.array(some_places(rng, 4))):
        shaper, expected = chooser.covering(places), Shaper.of(kind, mode)
        assert shaper.times == pytest.approx(expected.times, rel=1e-9)
        assert shaper.amplitudes == pytest.approx(expected.amplitudes, rel=1e-9)


@given(RANDOM, st.sampled_from(KINDS), st.floats(0.0, 0.45))
@reproducible
def test_at_most_five_percent_are_left_over_the_whole_range(rng, kind, beside):
    middles = rng.uniform(8.0, 20.0), rng.uniform(20.0, 60.0)
    known = [
        (place, *(f * rng.uniform(1.0 - beside, 1.0 + beside) for f in middles))
        for place in some_places(rng, 6)
    ]
    chooser = by_place(*known, kind=kind)
    passed = np.array(some_places(rng, 3))
    for places in (None, passed):
        shaper = chooser.covering(places)
        there = chooser.modes_at(np.array(chooser.places) if places is None else places)
        for each in there[0]:
            frequency = np.linspace(each.min(), each.max(), 500)
            assert residual(shaper, frequency, 0.03).max() <= 0.05 + 1e-4


def test_the_shortest_shaper_is_chosen_and_none_less_robust():
    chooser = by_place((LEFT, 9.0), (MIDDLE, 15.0), (RIGHT, 21.0), kind=ShaperKind.ZVD)
    impulses = []
    for half in (0.01, 0.03, 0.05, 0.1):
        shaper = chooser.covering(np.array([(x, 0.0, 0.25) for x in np.linspace(-half, half, 9)]))
        impulses.append(len(shaper.times))
    assert impulses == [3, 3, 4, 5]
    still = chooser.covering(np.array([LEFT]))
    assert still.times == pytest.approx(Shaper.of(ShaperKind.ZVD, Mode(9.0, 0.03)).times)


def test_where_no_kind_suffices_it_is_the_one_that_leaves_least():
    chooser = by_place((LEFT, 5.0), (RIGHT, 50.0))
    shaper = chooser.covering(None)
    frequency = np.linspace(5.0, 50.0, 500)
    left = residual(shaper, frequency, 0.03).max()
    assert left > 0.05
    for kind in KINDS[KINDS.index(ShaperKind.EI) :]:
        other = Shaper.of(kind, Mode(27.5, 0.03))
        assert left <= residual(other, frequency, 0.03).max() + 1e-3
    assert chooser.covering(None, shaper) is shaper


def test_the_present_shaper_stays_where_it_leaves_little():
    chooser = by_place((LEFT, 9.0), (MIDDLE, 15.0), (RIGHT, 21.0))
    present = chooser.covering(np.array([MIDDLE]))
    for x, stays in ((0.0, True), (0.03, True), (-0.03, True), (0.08, False), (-0.08, False)):
        place = np.array([(x, 0.0, 0.25)])
        left = float(residual(present, chooser.modes_at(place)[0, 0], 0.03)[0])
        assert (left < 0.1) is stays
        assert (chooser.covering(place, present) is present) is stays


def test_a_shaper_alone_is_the_same_everywhere():
    shaper = Shaper.of(ShaperKind.EI, Mode(15.0))
    assert shaper.covering(np.array([LEFT])) is shaper
    assert shaper.covering(None, Shaper.of(ShaperKind.ZV, Mode(9.0))) is shaper


def test_what_does_not_fit_is_refused_with_its_numbers():
    mode = Mode(15.0, 0.03)
    with pytest.raises(KinematicsError, match="0 places must be 1 to 100"):
        ShaperByPlace(ShaperKind.EI, (), ())
    with pytest.raises(KinematicsError, match="1 sets of modes are not 2 places"):
        ShaperByPlace(ShaperKind.EI, (LEFT, RIGHT), ((mode,),))
    with pytest.raises(KinematicsError, match=r"1 to 2 modes, and as many .*, not \[1, 2\]"):
        ShaperByPlace(ShaperKind.EI, (LEFT, RIGHT), ((mode,), (mode, mode)))
    with pytest.raises(OutOfBoundsError, match="of place 1 from place 3 = 0 m must be at least"):
        by_place((LEFT, 9.0), (RIGHT, 9.0), (LEFT, 9.0))
    with pytest.raises(WrongShapeError, match=r"places\[0\]"):
        ShaperByPlace(ShaperKind.EI, ((0.0, 0.0),), ((mode,),))  # type: ignore[arg-type]
