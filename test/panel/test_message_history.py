"""The history of messages of the page."""

from __future__ import annotations

from tri_glide_kinematics.panel.operators import KEPT, LONGEST, MessageHistory


def test_the_newest_is_first_and_the_oldest_are_forgotten() -> None:
    history = MessageHistory()
    for number in range(3 * KEPT):
        history.add("ready", f"message {number}")
    texts = [entry.text for entry in history]
    assert len(texts) == KEPT
    assert texts[0] == f"message {3 * KEPT - 1}"
    assert texts[-1] == f"message {2 * KEPT}"


def test_what_is_told_again_is_counted() -> None:
    history = MessageHistory()
    for _ in range(1000):
        history.add("refusal", "no", "log")
    history.add("ready", "no")
    assert [(entry.color, entry.count) for entry in history] == [("ready", 1), ("refusal", 1000)]
    assert history.changes == 1001


def test_a_long_text_is_cut() -> None:
    history = MessageHistory()
    history.add("refusal", "x" * 10_000, "y" * 10_000)
    (entry,) = history
    assert len(entry.text) == len(entry.log) == LONGEST
    assert len(entry.clock) == len("12:34:56")
