"""Places are filled in order, each once."""

from __future__ import annotations

import pytest

from tri_glide_kinematics.errors import OutOfBoundsError
from tri_glide_kinematics.picking import Places, grid

TRAY = grid((0.1, 0.2, -0.3), (2, 3), ((0.0, 0.05, 0.0), (0.03, 0.0, 0.001)))


def test_a_grid_is_filled_row_by_row_until_it_is_full():
    places = Places(TRAY)
    taken = [places.take() for _ in range(6)]
    assert [place.number for place in taken] == list(range(6))
    assert taken[5].position == pytest.approx((0.16, 0.25, -0.298))
    assert places.is_full
    places.empty()
    assert places.take() == taken[0]


def test_a_place_that_got_no_part_is_the_next_one_and_is_used_once():
    places = Places(TRAY)
    first, second, _ = (places.take() for _ in range(3))
    for place in (second, first, second):
        places.give_back(place)
    assert [places.take().number for _ in range(4)] == [0, 1, 3, 4]


def test_a_fixed_place_is_never_full():
    places = Places(TRAY[:1], is_fixed=True)
    assert {places.take() for _ in range(9)} == {(0, TRAY[0])}
    assert not places.is_full


@pytest.mark.parametrize("counts", [(0, 3), (2, -1)])
def test_a_grid_without_a_row_or_a_column_is_refused(counts):
    with pytest.raises(OutOfBoundsError, match="at least 1"):
        grid((0.0, 0.0, 0.0), counts, ((0.0, 0.05, 0.0), (0.03, 0.0, 0.0)))
