"""Which messages of a held button move the machine."""

from __future__ import annotations

from tri_glide_kinematics.panel.operators import LONGEST_GAP, RENEWALS, HeldJog
from tri_glide_kinematics.settings import IK_NODE

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
PERIOD = 1.0 / RENEWALS


def moves(hold: HeldJog, begin: float, count: int = 5, page: int = 0) -> list[bool]:
    """Renew ``count`` times; return which of the messages move the machine."""
    return [hold.renew(page, X, begin + number * PERIOD) for number in range(count)]


def test_it_moves_from_the_second_message_on() -> None:
    assert moves(HeldJog(), 10.0) == [False, True, True, True, True]


def test_a_page_that_nobody_sees_moves_nothing() -> None:
    # Browsers give such a page one turn a second, or one a minute.
    hold = HeldJog()
    times = [0.0, PERIOD, 1.0, 2.0, 3.0, 63.0, 123.0]
    assert [hold.renew(0, X, time) for time in times] == [False, True] + 5 * [False]


def test_it_ends_before_ik_node_takes_a_pause_for_the_end_of_a_jog() -> None:
    (timeout,) = (each.default for each in IK_NODE if each.name == "twist_timeout")
    assert timeout > LONGEST_GAP


def test_a_short_hiccup_is_forgiven_and_after_a_long_one_it_begins_anew() -> None:
    hold = HeldJog()
    moves(hold, 0.0, 2)
    assert hold.renew(0, X, PERIOD + LONGEST_GAP - 0.01)
    assert moves(hold, 1.0) == [False, True, True, True, True]


def test_what_was_ended_waits_for_the_release() -> None:
    hold = HeldJog()
    moves(hold, 0.0)
    hold.end()
    assert not any(moves(hold, 5 * PERIOD))
    # With a gap, which ik_node takes for a release, as well.
    assert not any(moves(hold, 10.0))
    hold.release(0)
    assert any(moves(hold, 11.0))


def test_to_end_nothing_bars_nobody() -> None:
    hold = HeldJog()
    hold.end()
    assert any(moves(hold, 0.0))


def test_messages_that_come_all_at_once_move_nothing() -> None:
    # As after the panel was frozen, with a button that was held before, and one pressed meanwhile.
    hold = HeldJog()
    moves(hold, 0.0)
    assert not any(hold.renew(0, X, 3.0 + 0.001 * number) for number in range(90))
    hold.release(0)
    assert not any(hold.renew(0, X, 3.1 + 0.001 * number) for number in range(90))


def test_another_button_and_another_page_begin_anew() -> None:
    hold = HeldJog()
    hold.renew(0, X, 0.0)
    assert not hold.renew(0, Y, PERIOD)
    assert not hold.renew(1, Y, 2 * PERIOD)
    assert hold.renew(1, Y, 3 * PERIOD)


def test_release_ends_a_jog_of_its_own_page() -> None:
    hold = HeldJog()
    moves(hold, 0.0)
    assert not hold.release(1)
    assert hold.release(0)
    assert not hold.release(0)
    hold.renew(0, X, 1.0)
    assert not hold.release(0), "nothing has moved"
