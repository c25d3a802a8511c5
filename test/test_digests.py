"""Whether moves of the code have changed what it does: see ``benchmarks/digests.py``."""

import json

import pytest

from benchmarks.digests import KEPT, PATHS, STEPS, environment, without_vector_units


def test_setpoints_and_texts_are_those_that_are_kept() -> None:
    kept = json.loads(KEPT.read_text(encoding="utf-8"))
    if environment() != kept["environment"]:
        pytest.skip(f"the last bits may differ: kept with {kept['environment']}")
    run = without_vector_units(["--steps", str(STEPS), "--paths", str(PATHS)])
    found, expected = json.loads(run.stdout), kept["digests"]
    changed = sorted(name for name in expected if found.get(name) != expected[name])
    assert not changed
    assert found.keys() == expected.keys()
