"""Every fault in every state: the machine rests inside its limits, and the documents tell it."""

from __future__ import annotations

from pathlib import Path

import pytest
from fault_campaign import FAULTS, outcomes, table

DOCUMENT = Path(__file__).parents[2] / "docs" / "faults.md"
# Nothing is wrong with the machine then.
HARMLESS = {"bytes that are no path"}
ON_ITS_WAY = {"jogging", "tracking"}


@pytest.fixture(scope="module")
def found():
    return outcomes()


@pytest.mark.parametrize("fault", FAULTS)
def test_after_each_fault_the_machine_rests_inside_its_limits(found, fault):
    for (state, kind), outcome in found.items():
        if kind == fault:
            assert not outcome.violations, (state, outcome)
            assert outcome.rests or (fault in HARMLESS and state in ON_ITS_WAY), (state, outcome)


def test_the_document_shows_what_the_machine_did(found):
    assert table(found) in DOCUMENT.read_text()
