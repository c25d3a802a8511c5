"""Frames as lines of text: whole ones are read, however they come."""

import os
import random
from itertools import pairwise

import pytest
from soak import many, seed

from tri_glide_kinematics.drives import CobId, Frame, LineReader, Terminals, encoded


def test_frames_are_the_same_after_any_cuts_and_between_answers():
    choice = random.Random(seed(1))
    for _ in range(many(50)):
        reader = LineReader()
        frames: list[Frame] = [
            (choice.randrange(0x800), choice.randbytes(choice.randrange(9))) for _ in range(20)
        ]
        noise = [choice.choice([b"", b"z\r", b"\r", b"\a", b"t12\r", b"V1013\r"]) for _ in frames]
        text = b"".join(a + encoded([frame]) for a, frame in zip(noise, frames))
        read = []
        while text:
            count = choice.randrange(1, 40)
            read += reader.frames(text[:count])
            text = text[count:]
        assert read == frames
        assert reader.refusals == noise.count(b"\a")


class Listener:
    """One on the bus who keeps the times at which he has heard SYNC."""

    def __init__(self) -> None:
        self.now = 0.0
        self.syncs: list[float] = []

    def advance(self, now: float) -> list[Frame]:
        assert now >= self.now
        self.now = now
        return []

    def receive(self, frame: Frame) -> None:
        assert frame == (CobId.SYNC, b"")
        self.syncs.append(self.now)


def test_what_came_while_others_had_the_computer_did_not_come_all_at_once():
    terminals, listener = Terminals(), Listener()
    near = os.open(terminals.paths[0], os.O_RDWR | os.O_NOCTTY)
    os.write(near, encoded([(CobId.SYNC, b"")] * 10))
    terminals.serve([listener], lambda: len(listener.syncs) < 10)
    first, *others = (b - a for a, b in pairwise(listener.syncs))
    assert first > 0.0
    assert others == pytest.approx([first] * 8, rel=1e-3)
    os.close(near)
    terminals.close()
