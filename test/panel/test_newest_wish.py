"""Of several wishes for a parameter the newest is sent, when the one before is answered."""

from __future__ import annotations

from tri_glide_kinematics.panel.link import NewestWish


class Link:
    """Takes parameters, and answers when it is told to."""

    def __init__(self):
        self.is_there = True
        self.sent = []
        self.answer = None

    def set_parameters(self, what, values, then):
        if self.is_there:
            self.sent.append((what, values))
            self.answer = then
        return self.is_there


def test_the_newest_wish_is_sent_when_the_one_before_is_answered():
    link, shown = Link(), []
    wish = NewestWish(link, "override", "path_speed_scale", lambda: shown.append("what holds"))
    for value in (0.5, 0.6, 0.7):
        wish.set(value)
    assert link.sent == [("override", {"path_speed_scale": 0.5})]
    # The newest may hold, though one before was refused.
    link.answer(False)
    assert link.sent[1:] == [("override", {"path_speed_scale": 0.7})]
    assert wish.is_setting and not shown
    # What pages have shown meanwhile may be older.
    link.answer(True)
    assert shown == ["what holds"] and not wish.is_setting
    wish.set(0.8)
    assert [values["path_speed_scale"] for _, values in link.sent] == [0.5, 0.7, 0.8]
    link.answer(False)
    assert shown == ["what holds"] * 2


def test_a_wish_that_nobody_takes_is_shown_no_more_and_holds_up_no_other():
    link, shown = Link(), []
    wish = NewestWish(link, "override", "path_speed_scale", lambda: shown.append("what holds"))
    link.is_there = False
    wish.set(0.5)
    assert shown == ["what holds"]
    link.is_there = True
    wish.set(0.6)
    assert link.sent == [("override", {"path_speed_scale": 0.6})]
