"""A shorter form of the soak: random commands of every kind, every setpoint checked."""

import numpy as np
import pytest
from soak import many, seed, some

from benchmarks.judge import COARSE, SCENARIOS, Findings, Judge
from benchmarks.soak_motion import soak

STEPS = many(6_000)
# Of coarse steps: whole plans are made in each.
COARSE_STEPS = many(500)
# At first one of each kind of motion, of plans, of machines and workspaces.
CASES = (SCENARIOS[2], SCENARIOS[11], *SCENARIOS[:2], *SCENARIOS[3:11])


@pytest.mark.slow
@pytest.mark.parametrize("scenario", some(CASES, 2), ids=str)
def test_no_sequence_of_commands_breaks_a_limit(scenario):
    findings = Findings()
    soak(scenario, STEPS, seed=seed(42), findings=findings)
    assert findings.violations == []
    assert findings.steps == STEPS
    # The soak is worth its name: commands of each kind, mostly in motion, and limits used in full.
    assert len(findings.commands) >= 9
    assert findings.still < 0.7 * STEPS
    assert findings.peaks.max() == pytest.approx(1.0, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", COARSE, ids=str)
def test_no_length_of_the_steps_breaks_a_limit(scenario):
    findings = Findings()
    soak(scenario, COARSE_STEPS, seed=seed(42), findings=findings)
    assert findings.violations == []
    # A plan with a shaper takes some pieces, one or two in a step.
    assert findings.still < 0.6 * COARSE_STEPS
    assert findings.peaks[:2].max() == pytest.approx(1.0, abs=0.01)


def test_judge_compares_batches_without_a_gap():
    """A step between two batches is seen, unless the machine was started there."""
    scenario = SCENARIOS[0]
    bounds = np.tile(np.array((1.0, 10.0, 200.0))[:, np.newaxis], (4, 1, 3))
    for start, clean in ((4, False), (0, True)):
        findings = Findings()
        judge = Judge(scenario, findings)
        judge.add(np.full((4, 3), 0.5), bounds, np.arange(4))
        judge.add(np.full((4, 3), 0.6), bounds, np.arange(start, start + 4))
        assert (findings.violations == []) is clean
        assert (findings.peaks > 1.0).all() is not clean
        assert all("in row 4 of" in text for text in findings.violations[:1])


def test_judge_notices_travel_reach_and_conditioning():
    narrow = SCENARIOS[2]
    bounds = np.full((4, 3, 3), 1e9)
    for heights, text in (
        ((0.9, 0.84, 0.84), "travel"),
        ((0.6, 0.75, 0.6), "workspace"),
        ((0.5, 0.85, 0.5), "condition"),
    ):
        findings = Findings()
        Judge(narrow, findings).add(np.tile(heights, (4, 1)), bounds, np.arange(4))
        assert any(text in violation for violation in findings.violations), text
