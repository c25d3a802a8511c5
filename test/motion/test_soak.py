"""A shorter form of the soak: random commands of every kind, every setpoint checked."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import soak_motion
from benchmarks.soak_motion import SCENARIOS, Findings, Judge, soak

STEPS = 40_000


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda s: f"{s.kind.value}-{s.dt}")
def test_no_sequence_of_commands_breaks_a_limit(scenario):
    findings = Findings()
    soak(scenario, STEPS, seed=42, findings=findings)
    assert findings.violations == []
    assert findings.steps == STEPS
    # The soak is worth its name: commands of each kind, mostly in motion, and limits used in full.
    assert len(findings.commands) >= 9
    assert findings.still < 0.5 * STEPS
    assert findings.peaks.max() == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_judge_notices_a_violation_of_each_derivative(order):
    scenario = SCENARIOS[0]
    bound = (1.0, 10.0, 200.0)[order - 1]
    times = scenario.dt * np.arange(80.0)
    # A polynomial whose derivative of this order is constant, a little beyond the limit.
    height = 0.5 + 1.002 * bound * times**order / np.prod(np.arange(1.0, order + 1.0))
    heights = np.repeat(height[:, np.newaxis], 3, axis=1)
    bounds = np.tile(np.array((1.0, 10.0, 200.0))[:, np.newaxis], (80, 1, 3))
    wide = np.full_like(bounds, 1e9)
    wide[:, order - 1] = bounds[:, order - 1]
    findings = Findings()
    judge = Judge(scenario, findings)
    judge.add(heights[:40], wide[:40], np.arange(40))
    judge.add(heights[40:], wide[40:], np.arange(40, 80))
    assert findings.peaks[order - 1] == pytest.approx(1.002, rel=1e-4)
    assert soak_motion.QUANTITIES[order - 1] in findings.violations[0]


def test_judge_notices_travel_reach_and_conditioning():
    narrow = SCENARIOS[2]
    bounds = np.full((4, 3, 3), 1e9)
    for heights, text in (
        ((0.9, 0.84, 0.84), "travel"),
        ((0.6, 0.75, 0.6), "workspace"),
        ((0.6, 0.6, 0.86), "condition"),
    ):
        findings = Findings()
        Judge(narrow, findings).add(np.tile(heights, (4, 1)), bounds, np.arange(4))
        assert any(text in violation for violation in findings.violations), text


def test_judge_forgives_the_step_of_a_restart_and_nothing_else():
    scenario = SCENARIOS[0]
    bounds = np.tile(np.array((1.0, 10.0, 200.0))[:, np.newaxis], (8, 1, 3))
    heights = np.repeat(np.array((0.5,) * 4 + (0.6,) * 4)[:, np.newaxis], 3, axis=1)
    for streak, clean in (((4, 5, 6, 7, 0, 1, 2, 3), True), (range(4, 12), False)):
        findings = Findings()
        Judge(scenario, findings).add(heights, bounds, np.array(streak))
        assert (findings.violations == []) is clean
