"""Frames as lines of text: whole ones are read, however they come."""

from __future__ import annotations

import random

from soak import many, seed

from tri_glide_kinematics.drives import Frame, LineReader, encoded


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
