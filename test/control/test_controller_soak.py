"""A shorter form of the soak of the controller: its laws under everything that can arrive."""

import pytest
from soak import many, seed, some

from benchmarks.judge import SCENARIOS, Findings
from benchmarks.soak_controller import soak

STEPS = many(4_000)
# At first one of each kind of motion, of plans, of machines and workspaces.
CASES = (SCENARIOS[2], SCENARIOS[11], *SCENARIOS[:2], *SCENARIOS[3:11])


@pytest.mark.slow
@pytest.mark.parametrize("scenario", some(CASES, 2), ids=str)
def test_the_state_is_true_whatever_arrives(scenario):
    findings = Findings()
    soak(scenario, STEPS, seed=seed(43), findings=findings)
    assert findings.violations == []
    assert findings.steps == STEPS
    # Nearly all kinds of events came, and were taken; the rare ones may be missing.
    assert len(findings.commands) >= 12
    assert findings.plans > STEPS / 400
