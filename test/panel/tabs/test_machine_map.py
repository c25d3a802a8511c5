"""Maps of the machine: what their colours mean."""

from __future__ import annotations

import numpy as np
import pytest
from strategies import is_inside

from tri_glide_kinematics.control import TEACH_SPEED
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.tabs.machine_map import (
    COLORS,
    OPACITY,
    QUANTITIES,
    Level,
    colored,
    span_of,
)
from tri_glide_kinematics.settings import IK_NODE

FACTS = MachineFacts({parameter.name: parameter.default for parameter in IK_NODE})
DRIVE = (10.0, 80.0, 50.0)


@pytest.fixture(scope="module")
def level() -> Level:
    return Level.of(FACTS)


def values_of(name: str, level: Level, speed: float = np.inf) -> np.ndarray:
    return QUANTITIES[name].values(level.found, speed, DRIVE)


def test_values_are_those_of_the_machine_in_the_units_of_the_page(level: Level) -> None:
    machine = FACTS.machine
    rows = np.flatnonzero(level.inside(0.25))[::500]
    assert len(rows) > 5
    for row in rows:
        jacobian = machine.jacobian((*level.places[row], 0.25))
        inverse = np.linalg.inv(jacobian)
        singular = np.linalg.svd(jacobian, compute_uv=False)
        signs = np.array(np.meshgrid(*((-1, 1),) * 3)).reshape(3, -1)
        expected = {
            "condition number": singular[0] / singular[2],
            # A slider is as fast as the length of its row for a platform of speed 1.
            "speed": 1e3 * (FACTS.limits.velocity / np.linalg.norm(jacobian, axis=1)).min(),
            "force": 80.0 / np.linalg.norm(inverse, axis=0).max(),
            "resolution": 10.0 * np.linalg.norm(inverse @ signs, axis=0).max(),
            "stiffness": 50.0 * singular[2] ** 2,
        }
        assert {name: values_of(name, level)[row] for name in QUANTITIES} == pytest.approx(expected)


def test_a_slow_platform_bounds_the_map_of_the_speed(level: Level) -> None:
    slow = FACTS.with_teach_mode(True).bounds.limits.platform_speed
    assert slow == TEACH_SPEED
    least, largest = span_of(values_of("speed", level, slow))
    assert largest == 250.0
    assert least == span_of(values_of("speed", level))[0]


def test_the_platform_may_be_where_a_level_has_colours(level: Level) -> None:
    low, high = level.ends
    for height in (low - 1e-6, high + 1e-6):
        assert not level.inside(height).any()
    inside = level.inside(0.3)
    tried = range(0, len(inside), 37)
    found = [is_inside(FACTS.workspace, (*level.places[row], 0.3)) for row in tried]
    assert 20 < sum(found) < len(tried) - 20
    assert [bool(inside[row]) for row in tried] == found


@pytest.mark.parametrize("more_is_better", [True, False])
def test_the_best_value_is_yellow_and_what_is_not_known_is_not_seen(more_is_better: bool) -> None:
    colors = colored(
        np.array((2.0, 3.0, np.nan, np.inf)), (2.0, 3.0), more_is_better=more_is_better
    )
    worst, best = (0, 1) if more_is_better else (1, 0)
    assert colors[worst].tolist() == [*COLORS[0], OPACITY]
    assert colors[best].tolist() == [*COLORS[-1], OPACITY]
    assert colors[2:, 3].tolist() == [0, 0]
    # All the same, but for rounding.
    same = colored(np.array((2.0, 2.0 + 1e-15)), (2.0, 2.0 + 1e-15), more_is_better=more_is_better)
    assert same[0].tolist() == same[1].tolist() == [*COLORS[-1], OPACITY]
    assert np.isnan(span_of(np.array((np.nan, np.inf)))).all()
