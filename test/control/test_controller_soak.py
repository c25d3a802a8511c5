"""A shorter form of the soak of the controller: its laws under everything that can arrive."""

from __future__ import annotations

import pytest
from soak import many, seed

from benchmarks.judge import SCENARIOS, Findings
from benchmarks.soak_controller import soak

STEPS = many(6_000)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", SCENARIOS, ids=str)
def test_the_state_is_true_whatever_arrives(scenario):
    findings = Findings()
    soak(scenario, STEPS, seed=seed(43), findings=findings)
    assert findings.violations == []
    assert findings.steps == STEPS
    # Nearly all kinds of events came, and were taken; the rare ones may be missing.
    assert len(findings.commands) >= 15
    assert findings.plans > STEPS / 400
