"""How soon a stop is over, where it leads, and what it costs; the bench has more states."""

import math

import numpy as np
import pytest
from motion_machine import LIMITS, engine, run

from benchmarks.bench_stops import KINDS, Drive, Kind, measure, own_stop, states, stopped
from tri_glide_kinematics.motion import MotionPhase
from tri_glide_kinematics.motion.moves import own_stop as shortest
from tri_glide_kinematics.motion.moves.stopping import LONGEST_ON_LINE
from tri_glide_kinematics.motion.trajectory import RuckigPlanner

# So many states take a quarter of a second.
COUNTS = {
    "slider moves": 12,
    "lines": 8,
    "jogs, steady": 12,
    "jogs, just begun": 12,
    "jogs, just changed": 8,
    "tracking": 2,
    "paths at full speed": 4,
    "paths with a speed": 4,
}


def kind_of(name: str) -> Kind:
    return next(kind for kind in KINDS if kind.name == name)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_stop_is_hardly_longer_than_the_sliders_own_stop(kind):
    found = measure(kind, COUNTS[kind.name], seed=2)
    assert found.findings.violations == []
    assert len(found.ratios) > 0.9 * COUNTS[kind.name]
    assert found.is_reached, found.figures


def test_the_sliders_own_stop_is_as_short_as_ruckig_has_it():
    ruckig = RuckigPlanner(3)
    for drive in states(kind_of("slider moves"), 40, seed=3):
        state = drive.engine.state
        limits = drive.scenario.limits
        bounds = (limits.velocity, limits.acceleration, limits.jerk)
        phases = ruckig.to_rest(state.velocities, state.accelerations, bounds)
        theirs = max(sum(length for length, _ in each) for each in phases)
        assert shortest(state, limits).duration == pytest.approx(theirs, abs=1e-6)


def test_a_stop_of_a_line_stays_on_it():
    def one_line(drive: Drive) -> None:
        drive.engine.move_to(drive.place())
        drive.run(drive.rng.uniform(0.01, 0.8))

    left = 0
    for drive in states(kind_of("lines")._replace(drive=one_line), 12, seed=4):
        machine, before = drive.workspace.machine, drive.engine.state
        begin, velocity = machine.forward_velocity(before.heights, before.velocities)
        own, inside = own_stop(drive)
        since = len(drive.heights)
        until_rest, _ = stopped(drive)
        offsets = machine.forward_batch(np.array(drive.heights[since:])) - begin
        direction = np.array(velocity) / math.hypot(*velocity)
        beside = np.linalg.norm(np.cross(offsets, direction), axis=1)
        if beside.max() > 1e-6:
            # What is left is the sliders' own stop, as soon as it can be.
            assert until_rest < 1.1 * own + 0.01
            left += 1
        elif inside:
            assert until_rest < LONGEST_ON_LINE * own + 0.01
    assert left <= 2


@pytest.mark.parametrize("second", [(0.3, 0.0, 0.0), (-0.4, 0.2, 0.1), (0.0, 0.0, -0.5)])
def test_a_stop_just_after_a_new_twist_is_soon_over(second):
    """The braking that was certified with the last step went on against the new direction."""
    jogging = engine()
    jogging.jog((0.0, 0.35, 0.1))
    run(jogging, 0.3)
    for _ in range(20):
        jogging.jog(second)
        run(jogging, 0.004)
        bound = shortest(jogging.state, LIMITS).duration
        jogging.stop()
        assert jogging.remaining <= 1.5 * bound + 1e-9
        jogging.jog(second)


def test_a_stop_takes_the_place_of_a_pause_that_takes_longer():
    """A pause stays on its path at any price; a stop that follows need not."""
    sooner = 0
    for drive in states(kind_of("paths at full speed"), 5, seed=6):
        following = drive.engine
        following.pause()
        for _ in range(20):
            drive.cycle()
        own, inside = own_stop(drive)
        if following.phase is not MotionPhase.STOPPING or not inside or own < 0.02:
            continue
        before = following.remaining
        until_rest, _ = stopped(drive)
        assert until_rest <= before + 1e-9
        assert until_rest <= 2.0 * own
        sooner += 1
    assert sooner
