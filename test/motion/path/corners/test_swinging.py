"""Roundings that swing out: their form, their tolerance beside others, the room they use."""

from itertools import product

import numpy as np
import pytest

from testing.path_samples import random_path
from tri_glide_kinematics.motion.path import PlatformPath
from tri_glide_kinematics.motion.path.corners import FARTHEST_SWING, SWING_REACH
from tri_glide_kinematics.motion.path.corners.widths import NARROWER, WIDEST, swing_of

TOLERANCE = 1e-3
PLACES = np.linspace(0.0, 1.0, 401)


def hat(x, width):
    return width / 6.0 * np.maximum(1.0 - np.abs(x) / width, 0.0) ** 3


def tapering(x, height):
    width = height / 0.115
    wide, middle, narrow = (
        np.maximum(1.0 - np.abs(x) / w, 0.0) ** 4 * w / 8.0
        for w in (width, 0.6 * width, 0.2 * width)
    )
    return 0.75 * wide + 0.3 * middle - 0.05 * narrow


def rounding(x, height, reach, part=1.0):
    swing = part * float(swing_of(reach / height))
    wide, narrow = (hat(x, w) for w in (reach, NARROWER * reach))
    top = (1.0 - NARROWER) * reach / 6.0
    return tapering(x, (1.0 + swing) * height) - swing * height * (wide - narrow) / top


def driven(*points, tolerance=TOLERANCE):
    return PlatformPath.through(points, tolerance).driven


@pytest.mark.parametrize("room", [0.018, 0.03, 0.04, 0.2])
def test_the_form_is_that_of_the_formulas(room):
    path = driven((0, 0, 0), (room, 0, 0), (room, room, 0))
    x = np.linspace(-room, room, 800)[:-1]
    reach = min(SWING_REACH * room, FARTHEST_SWING * TOLERANCE)
    expected = rounding(x, TOLERANCE, reach)
    programmed = np.column_stack((room + np.minimum(x, 0.0), np.maximum(x, 0.0), 0.0 * x))
    found = path.derivatives(room + x, 0)[0] - programmed
    jump = np.array([-1.0, 1.0, 0.0])
    assert found == pytest.approx(expected[:, np.newaxis] * jump, abs=1e-10)
    assert path.widths.reaches == pytest.approx([reach])
    assert path.deviation_bound == pytest.approx(TOLERANCE, rel=1e-8)


def test_it_is_the_same_as_one_that_tapers_off_where_there_is_just_room_for_that():
    room = 2.0 * WIDEST * TOLERANCE
    for more, swings in ((-1e-6, False), (1e-6, True)):
        path = driven((0, 0, 0), (room + more, 0, 0), (room + more, 0.1, 0))
        assert (path.widths.swings[0] > 0.0) == swings
        assert path.widths.half_widths[0] == pytest.approx(WIDEST * TOLERANCE, rel=1e-3)


def test_two_beside_each_other_keep_the_larger_tolerance():
    """The way between is 1; each rounding may be narrower, for what is on its other side."""
    ratios = (
        2.0
        * SWING_REACH
        * WIDEST
        * np.array([1.0, 1.1, 1.3, 1.6, 2.0, 2.3, 2.5, 2.8, 3.3, 4.5, 7.0])
    )
    reaches = SWING_REACH * np.array([1.0, 0.9, 0.7, 0.4, 0.1])
    swinging = []
    # Where the line on the other side is longer, only a part of the swing is used.
    for ratio, reach, part in product(ratios.tolist(), reaches.tolist(), (1.0, 0.6, 0.2)):
        height = reach / ratio
        swinging.append((height, rounding(PLACES, height, reach, part) / height))
    # None is beyond its own tolerance, nor reaches the other joint.
    forms = np.array([form for _, form in swinging])
    assert np.abs(forms).max() == pytest.approx(1.0, abs=1e-12)
    assert forms.min() > -0.995
    assert (forms[:, -1] == 0.0).all()
    others = [(WIDEST * height, form) for height, form in swinging]
    for height in np.geomspace(1e-3, 0.16, 20).tolist():
        others.append((WIDEST * height, tapering(PLACES, height) / height))
        others.append((6.0 * height, hat(PLACES, 6.0 * height) / height))
    widths = np.array([width for width, _ in others])
    beside = np.abs([form[::-1] for _, form in others])
    for height, form in swinging:
        # Before one swings out, they do not overlap.
        fits = widths + WIDEST * height <= 1.0 + 1e-9
        for part in (1.0, 0.8, 0.5, 0.2, 0.02):
            for first, second in ((1.0, part), (part, 1.0)):
                together = first * np.abs(form) + second * beside[fits]
                assert together.max() <= 1.0 + 1e-12


def test_a_smooth_joint_with_a_smaller_tolerance_is_not_swung_out_at():
    def swings(tolerance):
        path = PlatformPath.start((0, 0, 0)).line_to((0.05, 0, 0), tolerance)
        path = path.line_to((0.1, 0, 0), TOLERANCE).line_to((0.1, 0.1, 0))
        return path.driven.widths.swings.tolist()

    assert swings(0.5 * TOLERANCE) == [0.0]
    assert swings(TOLERANCE) == swings(2.0 * TOLERANCE) != [0.0]


def test_a_smooth_joint_behind_a_stop_makes_no_difference():
    def swings(*points_and_tolerances):
        path = PlatformPath.start((0, 0, 0))
        for point, tolerance in points_and_tolerances:
            path = path.line_to(point, tolerance)
        return path.driven.widths.swings

    first = (((0.05, 0, 0), 1e-3), ((0.05, 0.05, 0), 0.0))
    last = (((0.1, 0.05, 0), 1e-4), ((0.1, 0.1, 0), 0.0))
    without = swings(*first, *last)
    assert (without > 0.0).all()
    assert swings(*first, ((0.07, 0.05, 0), 1e-4), *last) == pytest.approx(without)


def test_between_a_short_and_a_long_line_it_swings_out_less():
    def swing(*lengths):
        return driven((0, 0, 0), (lengths[0], 0, 0), (*lengths, 0)).widths.swings[0]

    assert swing(0.03, 0.06) == pytest.approx(0.5 * swing(0.03, 0.03))
    assert swing(0.06, 0.03) == pytest.approx(swing(0.03, 0.06))
    # As far as it may reach at all.
    assert swing(0.2, 0.3) == pytest.approx(swing(0.2, 0.2))


def test_it_reaches_over_no_joint_but_its_own():
    rng = np.random.default_rng(5)
    found = 0
    for _ in range(50):
        path = random_path(rng, arcs=0.2)[0].driven
        joints, widths = path.rounded, path.widths
        reaches, swinging = widths.reaches, widths.swings > 0.0
        found += np.count_nonzero(swinging)
        assert (reaches <= joints.rooms).all()
        gaps = np.diff(joints.ways)
        assert (reaches[1:] < gaps)[swinging[1:]].all()
        assert (reaches[:-1] < gaps)[swinging[:-1]].all()
        # Those that are not alone it does not reach.
        alone = widths.single & (joints.bends == 0.0)
        sums = reaches[1:] + reaches[:-1]
        beside = (swinging[1:] & ~alone[:-1]) | (swinging[:-1] & ~alone[1:])
        assert (sums <= gaps)[beside].all()
    assert found > 50


def test_the_reversed_path_has_the_same_roundings():
    rng = np.random.default_rng(6)
    for _ in range(20):
        path = PlatformPath.through(rng.uniform(-0.1, 0.1, (6, 3)), TOLERANCE)
        widths, reversed_widths = path.driven.widths, path.reversed().driven.widths
        assert widths.swings == pytest.approx(reversed_widths.swings[::-1], abs=1e-9)
        assert widths.reaches == pytest.approx(reversed_widths.reaches[::-1], rel=1e-9)
