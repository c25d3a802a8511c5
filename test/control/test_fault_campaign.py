"""Every fault in every state: the machine rests inside its limits, and the documents tell it."""

from pathlib import Path

import pytest
from fault_campaign import FAULTS, run
from machine_states import STATES

DOCUMENT = Path(__file__).parents[2] / "docs" / "faults.md"
# Nothing is wrong with the machine then.
HARMLESS = {"bytes that are no path"}
ON_ITS_WAY = {"jogging", "tracking"}


def told_of(fault):
    """Return what the document tells of each state after a fault."""
    lines = DOCUMENT.read_text().splitlines()
    head = next(line for line in lines if line.startswith("| state | ") and fault in line)
    rows = [line.strip("| ").split(" | ") for line in lines[lines.index(head) :]]
    column = rows[0].index(fault)
    return {row[0]: row[column] for row in rows[2 : 2 + len(STATES)]}


@pytest.mark.parametrize("fault", FAULTS)
def test_after_each_fault_the_machine_rests_inside_its_limits_as_the_document_tells(fault):
    found = {state: run(state, FAULTS[fault]) for state in STATES}
    for state, outcome in found.items():
        assert not outcome.violations, (state, outcome)
        assert outcome.rests or (fault in HARMLESS and state in ON_ITS_WAY), (state, outcome)
    assert told_of(fault) == {state: outcome.text for state, outcome in found.items()}
