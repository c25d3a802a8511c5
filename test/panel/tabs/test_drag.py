"""Where the handle is let go, and by whom."""

from tri_glide_kinematics.panel.tabs.live_view import Drag

OPERATOR, OTHER = 0, 1
HERE, THERE = (0.01, 0.0, 0.25), (-0.08, 0.0, 0.3)


def test_it_is_let_go_where_its_page_has_dragged_it() -> None:
    drag = Drag()
    drag.begin(OPERATOR)
    drag.move(OPERATOR, HERE)
    assert drag.end(OPERATOR) == HERE
    assert drag.page is None
    assert drag.end(OPERATOR) is None


def test_another_page_changes_nothing_and_ends_nothing() -> None:
    drag = Drag()
    drag.begin(OPERATOR)
    drag.move(OPERATOR, HERE)
    drag.move(OTHER, THERE)
    assert drag.end(OTHER) is None
    assert drag.end(OPERATOR) == HERE


def test_who_has_not_begun_moves_nothing() -> None:
    drag = Drag(place=HERE)
    drag.move(OTHER, THERE)
    assert drag.place == HERE
    assert drag.end(OTHER) is None
