"""What cameras see on a belt becomes one part each, with one outcome."""

import math
import random

import pytest
from soak import many, seed

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.picking import PartEndedError, PartOutcome, Parts, Sighting

DIRECTION = (math.cos(0.7), math.sin(0.7), 0.0)
NOISE = 1e-3  # m
NEIGHBOUR = 0.015  # m
SPEED = 0.1  # m/s
PICTURE = 0.04  # s


def place(along, across=0.0):
    """Return a place in the frame of the belt."""
    x, y, _ = DIRECTION
    return (x * along - y * across, y * along + x * across, -0.3)


class Camera:
    """Sees what lies at places of a belt that runs at ``SPEED``, with noise and an offset."""

    def __init__(self, parts, number, offset=0.0, noise=NOISE, name="left"):
        self.parts, self.random, self.name = parts, random.Random(seed(number)), name
        self.offset, self.noise = offset, noise

    def see(self, time, position, **others):
        """Tell that something was seen; return the part that it is."""
        x, y, z = (p + SPEED * time * d for p, d in zip(position, DIRECTION))
        x += self.random.gauss(0.0, self.noise) + self.offset
        seen = Sighting(time, (x, y + self.random.gauss(0.0, self.noise), z), camera=self.name)
        return self.parts.see(seen._replace(**others), SPEED * time)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(many(2)))
def test_each_of_a_thousand_parts_is_one_part_whatever_it_is_called(number):
    offset = NOISE * (number % 2)
    drawn, parts = random.Random(seed(number)), Parts(DIRECTION)
    cameras = [Camera(parts, number), Camera(parts, number + 50, offset, name="right")]
    # Three beside each other, row after row.
    true = [place(-NEIGHBOUR * (n // 3), NEIGHBOUR * (n % 3 - 1)) for n in range(1000)]
    counts = [drawn.randint(2, 20) for _ in true]
    # What happens: when, and of which part which camera took a picture, and when; or that it ends.
    events = []
    for part, count in enumerate(counts):
        begin = NEIGHBOUR * (part // 3) / SPEED
        for _ in range(count):
            taken, eye = begin + PICTURE * drawn.randint(0, 50), drawn.randint(0, 1)
            # The pictures of one camera come so late that the part may be placed already.
            events.append((taken + 0.5 * eye, part, eye, taken))
        # The gripper comes when all pictures are taken. It misses a tenth, which is seen again.
        events.append((begin + 2.3, part, -1, 0.0))
        if not part % 10:
            events += [
                (begin + 2.3 + PICTURE * k, part, 0, begin + 2.3 + PICTURE * k) for k in (1, 30, 60)
            ]
    of = {}
    for time, part, eye, taken in sorted(events):
        if eye < 0:
            outcome = PartOutcome.PLACED if part % 10 else PartOutcome.MISSED
            parts.end(of[part], outcome, "", time)
            continue
        name = drawn.choice(("", "", str(part), str(drawn.randint(0, 9))))
        seen = cameras[eye].see(taken, true[part], identity=name)
        assert of.setdefault(part, seen) is seen or seen.is_doubtful
    assert not parts.on_belt()
    assert len({part.number for part in of.values()}) == len(true)
    # None was seen to move: then what was seen before would be forgotten.
    assert all(len(of[part].views) >= count for part, count in enumerate(counts))
    if not offset:
        squares = [
            len(of[part].views) * math.dist(of[part].position, where) ** 2
            for part, where in enumerate(true)
        ]
        assert math.sqrt(sum(squares) / len(squares)) < 1.5 * NOISE


def test_what_noise_has_made_two_parts_becomes_one_again_and_the_one_that_is_picked_stays():
    for taken in (0, 1):
        parts = Parts(DIRECTION)
        camera = Camera(parts, 1, noise=0.0)
        two = [camera.see(0.0, place(0.0)), camera.see(0.1, place(0.009))]
        assert two[0] is not two[1] and parts.on_belt() == [two[0]]
        two[taken].is_taken = True
        assert camera.see(0.2, place(0.004)) is two[taken]
        assert parts.on_belt() == [two[taken]] and len(two[taken].views) == 3


def test_what_is_seen_once_beside_a_part_is_one_when_it_is_seen_again_and_else_nothing():
    parts = Parts(DIRECTION)
    camera = Camera(parts, 1, noise=0.0)
    part, other = camera.see(0.0, place(0.0)), camera.see(0.0, place(0.011))
    lonely = camera.see(0.0, place(-0.012))
    assert parts.on_belt() == [part, lonely]
    parts.end(part, PartOutcome.PLACED, "", 0.1)
    assert parts.on_belt() == [lonely]
    assert camera.see(0.2, place(0.015)) is other
    assert parts.on_belt() == [other, lonely]


def test_a_part_that_was_missed_or_passed_does_not_come_back_while_it_is_in_view():
    for outcome in (PartOutcome.MISSED, PartOutcome.LOST, PartOutcome.PASSED):
        parts = Parts(DIRECTION)
        camera = Camera(parts, 2)
        part = camera.see(0.0, place(0.0))
        # One that noise has made of it as it was being picked goes with it.
        camera.see(0.02, place(0.009))
        parts.end(part, outcome, "no part held", 0.1)
        for picture in range(10):
            assert camera.see(0.2 + picture, place(0.002), identity="new") is part
        assert parts.on_belt() == [] and (part.outcome, part.text) == (outcome, "no part held")
        # It was not seen for long: whatever lies there came later.
        assert camera.see(15.0, place(0.0)) is not part


def test_where_a_part_was_placed_from_another_may_lie_and_late_pictures_show_the_first():
    parts = Parts(DIRECTION)
    camera = Camera(parts, 3)
    part = camera.see(0.0, place(0.0))
    parts.end(part, PartOutcome.PLACED, "", 1.0)
    assert camera.see(0.9, place(0.0)) is part
    other = camera.see(1.1, place(0.0))
    assert other is not part and parts.on_belt() == [other]
    assert camera.see(1.2, place(0.0)) is other


@pytest.mark.parametrize("speed", [0.02, 0.08])
def test_a_part_that_slides_is_one_part_which_lies_where_it_was_seen_after_that(speed):
    parts = Parts(DIRECTION)
    camera = Camera(parts, 4)
    for picture in range(80):
        time = PICTURE * picture
        along = speed * min(max(time - 0.8, 0.0), 1.2)
        part = camera.see(time, place(0.3 * along, along))
    assert len(parts.on_belt()) == 1
    assert math.dist(part.position, place(0.36 * speed, 1.2 * speed)) < NOISE


def test_parts_on_a_belt_whose_encoder_has_jumped_are_lost_and_known_no_more():
    parts = Parts(DIRECTION)
    camera = Camera(parts, 5)
    here, there, held = (camera.see(0.0, place(0.1 * number)) for number in range(3))
    held.is_taken = True
    parts.end(here, PartOutcome.MISSED, "", 0.1)
    assert parts.lose("the encoder has jumped", 0.2) == [there]
    assert there.outcome is PartOutcome.LOST and here.outcome is PartOutcome.MISSED
    assert held.outcome is None
    assert camera.see(0.3, place(0.0)) not in (here, there, held)


def test_two_parts_that_are_found_to_be_one_are_the_older_one():
    parts = Parts(DIRECTION)
    camera = Camera(parts, 7, noise=0.0)
    for number, way in enumerate((0.0, 0.0, 0.011, 0.011, 0.0065, 0.006)):
        part = camera.see(0.03 * number, place(way))
    assert parts.on_belt() == [part]
    assert part.number == 1


def test_a_part_is_what_its_views_say_and_ends_once():
    parts = Parts(DIRECTION)
    camera = Camera(parts, 6, noise=0.0)
    for name, kind, angle in (("", "nut", 3.1), ("7", "bolt", -3.1), ("9", "nut", 3.1)):
        part = camera.see(0.0, place(0.02), identity=name, kind=kind, angle=angle)
    assert part.kind == "nut" and part.number == 1
    assert abs(part.angle) > 3.1
    assert part.position == pytest.approx(place(0.02))
    parts.end(part, PartOutcome.PLACED, "", 1.0)
    with pytest.raises(PartEndedError, match="part 1 ended as PLACED"):
        parts.end(part, PartOutcome.LOST, "", 1.0)
    for wrong in (math.nan, math.inf):
        with pytest.raises(NotFiniteError):
            camera.see(0.0, place(wrong))
    with pytest.raises(OutOfBoundsError):
        Parts(DIRECTION, spacing=0.0)
