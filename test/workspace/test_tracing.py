"""The proof of a path between samples, on paths whose nearest place to the edge is known."""

import math

import numpy as np
import pytest

from tri_glide_kinematics.interruptible import at_once
from tri_glide_kinematics.workspace import TOLERANCE
from tri_glide_kinematics.workspace.tracing import Sample, Surroundings, traced

EVERYWHERE = Surroundings(math.inf, 1.0, 0.0)
END = 1.0


def is_accepted(probe, acceleration):
    return at_once(traced(probe, END, acceleration, in_piece=7)) is None


@pytest.mark.parametrize("bounded", ["slack", "travel"])
def test_a_parabola_is_accepted_just_where_its_lowest_place_is_inside(bounded):
    rng = np.random.default_rng(1)
    answers = []
    for _ in range(400):
        # It dips by so much below the edge at an instant that is no middle of anything.
        dip, at, bend = rng.uniform(-1e-4, 2e-4), rng.uniform(0.0, END), 10 ** rng.uniform(-2, 1)

        def probe(time, dip=dip, at=at, bend=bend):
            room = 0.5 * bend * (time - at) ** 2 - dip
            speed = bend * abs(time - at)
            return Sample(time, room >= 0.0, EVERYWHERE, speed, **{bounded: room})

        accepted = is_accepted(probe, bend)
        answers.append(accepted)
        assert accepted or dip > 0.0
        assert not accepted or dip <= TOLERANCE
    assert 50 < sum(answers) < 350


def test_a_line_is_accepted_just_where_it_passes_beside_a_forbidden_disc():
    rng = np.random.default_rng(2)
    answers = []
    for _ in range(400):
        radius, at, speed = rng.uniform(1e-3, 0.1), rng.uniform(0.0, END), rng.uniform(0.01, 1.0)
        beside = rng.uniform(-1e-4, 1e-4)

        def probe(time, radius=radius, at=at, speed=speed, beside=beside):
            room = math.hypot(speed * (time - at), radius + beside) - radius
            around = Surroundings(max(room, 0.0), 1.0, 0.0)
            return Sample(time, room >= 0.0, around, speed)

        accepted = is_accepted(probe, 0.0)
        answers.append(accepted)
        assert not accepted or beside >= -TOLERANCE
        assert accepted or beside < 2e-5
    assert 50 < sum(answers) < 350
