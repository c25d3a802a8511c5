"""What a simulated belt, encoder, camera and gripper do is what real ones do, at known times."""

import math
import random
from itertools import pairwise
from statistics import fmean, pstdev

import pytest

from tri_glide_kinematics.picking import (
    Readings,
    SimulatedBelt,
    SimulatedCamera,
    SimulatedEncoder,
    SimulatedGripper,
    SimulatedPart,
    laid_parts,
)

ALONG = (0.8, 0.6, 0.0)
BELT = SimulatedBelt(ALONG, 0.3, [(2.0, 0.1, 0.2), (4.0, -0.1, 0.2), (4.5, 0.0, 2.0)])


def at_rest(*places: tuple[float, float, float]) -> tuple[SimulatedBelt, list[SimulatedPart]]:
    """Return a belt that stands, and parts on it."""
    return SimulatedBelt(ALONG, 0.0), [SimulatedPart(*each) for each in enumerate(places)]


def test_a_belt_changes_its_speed_steadily_and_reverses():
    for time in (0.5, 2.3, 3.5, 4.2, 4.51, 6.0):
        before, state, after = (BELT.at(time + dt) for dt in (-1e-4, 0.0, 1e-4))
        velocity = (after.position - before.position) / 2e-4
        acceleration = (after.velocity - before.velocity) / 2e-4
        assert (velocity, acceleration) == pytest.approx(state[1:], abs=1e-6)
    # From 4 s on it would need 1 s to reverse; it is stopped in the middle of that.
    assert [BELT.at(time).velocity for time in (1.0, 2.5, 3.5, 4.5, 6.0)] == pytest.approx(
        [0.3, 0.2, 0.1, 0.0, 0.0]
    )


def test_parts_are_as_far_from_each_other_as_was_asked_for():
    for shape in ({}, {"at_random": True}):
        parts = laid_parts(BELT, 4001, 0.1, first=(0.0, 0.0, 0.02), width=0.2, **shape)
        places = [(0.8 * x + 0.6 * y, 0.8 * y - 0.6 * x) for x, y, _ in (p.position for p in parts)]
        gaps = [a[0] - b[0] for a, b in pairwise(places)]
        assert fmean(gaps) == pytest.approx(0.1, rel=0.04)
        assert min(gaps) == pytest.approx(0.015 if shape else 0.1, abs=1e-4)
        assert 0.098 < max(abs(aside) for _, aside in places) <= 0.1


def test_an_encoder_counts_wraps_jumps_and_is_silent():
    readings = Readings(100.0, 0.004, jitter=0.002)
    encoder = SimulatedEncoder(BELT, readings, 1e-4, 1000, [(1.0, 1.5)], [(1.7, 0.05)])
    assert encoder.take(0.0039) == []
    assert len(encoder.take(0.0041)) == 1
    reports = encoder.take(2.0)
    assert encoder.take(2.0) == []
    assert len(reports) == 149
    for time, position in reports:
        true = BELT.at(time).position + (0.05 if time >= 1.7 else 0.0)
        assert 0.0 <= (true - position + 1e-8) % 0.1 < 1.01e-4
        assert not 1.0 <= time < 1.5


def test_a_camera_sees_what_was_before_it_with_noise_and_without_some_names():
    parts = [SimulatedPart(0, (-0.8, -0.6, 0.0), slide=(0.02, 0.0, 0.0), since=3.0)]
    exact, noisy, fewer, nameless, renamed = (
        SimulatedCamera("left", BELT, parts, (-0.5, 0.2), Readings(1000.0, 0.15), *flaws).take(9.0)
        for flaws in ((), (1e-3,), (0.0, 0.5), (0.0, 0.0, 0.5), (0.0, 0.0, 0.0, 0.5))
    )
    assert exact[0].time == pytest.approx(0.5 / 0.3, abs=0.001)
    assert exact[-1].time == pytest.approx(8.85, abs=0.001)
    assert exact[-1].position[0] == pytest.approx(0.8 * (BELT.at(8.85).position - 1.0) + 0.117)
    for axis in (0, 1):
        off = [a.position[axis] - b.position[axis] for a, b in zip(noisy, exact)]
        assert (fmean(off), pstdev(off)) == pytest.approx((0.0, 0.001), abs=5e-5)
    half = pytest.approx(len(exact) / 2, rel=0.05)
    assert len(fewer) == half
    assert sum(not each.identity for each in nameless) == half
    assert len({each.identity for each in renamed}) == half


def test_a_gripper_takes_the_nearest_part_after_its_delay_and_lets_it_go():
    belt, parts = at_rest((0.0, 0.0, 0.0), (0.01, 0.0, 0.0), (0.1, 0.0, 0.0))
    gripper = SimulatedGripper(belt, parts)
    gripper.order(True, 1.0)
    point = (0.009, 0.002, 0.0)
    held = [(gripper.held, gripper.step(now, point)) for now in (1.019, 1.021, 1.04, 1.042)]
    assert [each[1] for each in held] == [False, False, False, True]
    assert held[1][0] is None
    assert held[2][0] is parts[1]
    gripper.order(False, 2.0)
    gripper.step(2.03, (0.3, 0.0, 0.1))
    assert (parts[1].taken, parts[1].placed) == (1.021, (0.3, 0.0, 0.1))
    gripper.order(True, 3.0)
    gripper.step(3.03, (0.0, 0.0, 0.004))
    assert gripper.grips[1] == (3.03, None, (0.0, 0.0, 0.004))
    assert gripper.grips[0].error == pytest.approx((-0.001, 0.002, 0.0))


def test_a_gripper_loses_as_many_parts_as_was_asked_for():
    belt, parts = at_rest(*[(float(x), 0.0, 0.0) for x in range(100)])
    gripper = SimulatedGripper(belt, parts, losing=0.3, random=random.Random(5))
    for part in parts:
        gripper.order(True, part.number)
        gripper.step(part.number + 0.1, part.position)
        gripper.order(False, part.number + 0.5)
        gripper.step(part.number + 0.6, part.position)
    lost = [part for part in parts if part.placed is None]
    assert 20 < len(lost) < 40
    assert all(math.isfinite(part.lost) for part in lost)
