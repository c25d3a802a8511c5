"""Which messages of a held button move the machine."""

from __future__ import annotations

from tri_glide_kinematics.panel.hold import LONGEST_GAP, RENEWALS, HeldJog

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
PERIOD = 1.0 / RENEWALS


def test_it_moves_from_the_second_message_on() -> None:
    hold = HeldJog()
    moved = [hold.renew(0, X, 10.0 + number * PERIOD) for number in range(5)]
    assert moved == [False, True, True, True, True]


def test_a_page_that_nobody_sees_moves_nothing() -> None:
    # Browsers give such a page one turn a second, or one a minute.
    hold = HeldJog()
    times = [0.0, PERIOD, 1.0, 2.0, 3.0, 63.0, 123.0]
    assert [hold.renew(0, X, time) for time in times] == [False, True] + 5 * [False]


def test_a_short_hiccup_is_forgiven() -> None:
    hold = HeldJog()
    hold.renew(0, X, 0.0)
    assert hold.renew(0, X, LONGEST_GAP - 0.01)
    assert not hold.renew(0, X, 2.0 * LONGEST_GAP)


def test_another_button_and_another_page_begin_anew() -> None:
    hold = HeldJog()
    hold.renew(0, X, 0.0)
    assert not hold.renew(0, Y, PERIOD)
    assert not hold.renew(1, Y, 2 * PERIOD)
    assert hold.renew(1, Y, 3 * PERIOD)


def test_release_ends_it_for_its_own_page_or_for_all() -> None:
    hold = HeldJog()
    hold.renew(0, X, 0.0)
    assert not hold.release(1)
    assert hold.release(0)
    assert not hold.release(0)
    assert not hold.renew(0, X, PERIOD)
    assert hold.release()
