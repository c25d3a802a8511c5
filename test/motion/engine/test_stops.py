"""A shorter form of the soak of stops: none breaks the law of stops."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bench_stops import MACHINES, PERIOD, Drive, own_stop
from benchmarks.judge import Findings, Judge
from benchmarks.soak_stops import ALWAYS_ALLOWED, LARGEST_RATIO, soak, stops
from tri_glide_kinematics.dynamics import Masses, SliderForces
from tri_glide_kinematics.motion import ForceLimits, MotionKind, MotionPhase, SliderLimits
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperKind


@pytest.mark.slow
def test_no_stop_takes_longer_than_the_law_allows():
    found = soak(stops(seed=9, compared=24), 48)
    assert found.violations == []
    assert len({stop.kind for stop in found.stops}) >= 4
    assert any(stop.optimum > 0.0 for stop in found.stops)


@pytest.mark.parametrize(("machine", "seed"), [(1, 2), (2, 3), (2, 10)])
def test_slider_moves_with_a_shaper_and_unequal_limits_obey_the_law(machine, seed):
    shaper = Shaper.of(ShaperKind.EI, Mode(12.0, 0.05))
    scenario = replace(MACHINES[machine], kind=MotionKind.SLIDER)
    drive = Drive(scenario, np.random.default_rng(seed))
    engine = drive.engine
    engine.set_shaper(shaper)
    for _ in range(8):
        engine.move_to(drive.place())
        drive.run(drive.rng.uniform(0.05, 0.4))
        if engine.phase is MotionPhase.IDLE:
            continue
        own, _ = own_stop(drive)
        allowed = max(LARGEST_RATIO * own, ALWAYS_ALLOWED) + shaper.duration
        engine.stop()
        begin = len(drive.heights)
        while engine.phase is not MotionPhase.IDLE:
            drive.cycle()
        assert (len(drive.heights) - begin - 1) * PERIOD <= allowed
        # What had to brake without the shaper has it again when it rests.
        assert engine.shaper is shaper
        assert not engine.shaper_pending
    findings = Findings()
    heights = np.array(drive.heights)
    table = np.broadcast_to(scenario.limits.table, (len(heights), 3, 3))
    Judge(scenario, findings).add(heights, table, np.arange(len(heights)))
    assert not findings.violations


@pytest.mark.parametrize("kind", list(MotionKind))
def test_a_stop_brakes_at_once_where_the_weight_leaves_little_of_the_forces(kind):
    limits = SliderLimits.uniform(1.2, 24.0, 8000.0)
    drive = Drive(replace(MACHINES[0], kind=kind, limits=limits), np.random.default_rng(3))
    engine = drive.engine
    masses = Masses.uniform(1.0, 0.3, 1.0, payload=0.5)
    bound = ForceLimits(SliderForces(drive.workspace.machine, masses), (34.0,) * 3, (50.0,) * 3)
    engine.set_limits(limits.with_added(bound))
    engine.move_to(drive.place())
    while engine.preparing:
        drive.cycle()
    drive.run(drive.rng.uniform(0.02, 0.1))
    earlier = engine.plan_number
    engine.stop()
    # It gets faster yet, so its plan cannot be slowed down; and the sliders' own stop is too hard.
    assert engine.plan_number > earlier
    forces, begin = [], len(drive.heights)
    while engine.phase is not MotionPhase.IDLE:
        drive.cycle()
        forces.append(bound.forces.forces(*engine.state))
    assert (len(drive.heights) - begin - 1) * PERIOD <= ALWAYS_ALLOWED
    assert max(np.max(forces) / 34.0, -np.min(forces) / 50.0) <= 1.0 + 1e-6
