"""Who has the controls."""

from __future__ import annotations

import random

import pytest

from tri_glide_kinematics.panel.operators import Controls


def controls(*pages: int) -> Controls:
    result = Controls()
    for page in pages:
        result.opened(page)
    return result


def test_the_first_page_has_them_and_the_second_has_to_ask() -> None:
    pages = controls(0, 1)
    assert pages.holder == 0
    assert not pages.ask(1)
    assert pages.asking == [1]
    pages.give(1)
    assert pages.holder == 0
    pages.give(0)
    assert pages.holder == 1
    assert not pages.asking


def test_they_are_free_after_the_end_of_the_page_that_had_them() -> None:
    pages = controls(0, 1)
    pages.closed(0)
    assert pages.holder is None
    assert pages.ask(1)
    assert pages.holder == 1


@pytest.mark.parametrize(("before", "holder"), [((0, 1), None), ((0,), 2)])
def test_a_page_that_comes_later_finds_itself_in_control_only_if_it_is_alone(
    before: tuple[int, ...], holder: int | None
) -> None:
    pages = controls(*before)
    pages.closed(0)
    pages.opened(2)
    assert pages.holder == holder


def test_whoever_asked_and_vanished_gets_nothing() -> None:
    pages = controls(0, 1, 2)
    pages.ask(1)
    pages.ask(2)
    pages.closed(1)
    pages.give(0)
    assert pages.holder == 2


def test_nobody_takes_them_from_another_page() -> None:
    source = random.Random(13)
    pages = Controls()
    for _ in range(5000):
        page, holder = source.randrange(5), pages.holder
        what = source.choice(("opened", "closed", "ask", "give"))
        getattr(pages, what)(page)
        assert pages.holder is None or pages.holder in pages.pages
        assert pages.holder not in pages.asking
        assert set(pages.asking) <= set(pages.pages)
        if holder is not None and pages.holder != holder:
            assert page == holder, "only who has them can lose them"
            assert what in ("closed", "give")
