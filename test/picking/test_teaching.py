"""What is taught is what there is, to the deviation that is told; what cannot be taught is told."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from soak import many, seed
from strategies import reproducible

from tri_glide_kinematics.calibration.fit import rotation_by
from tri_glide_kinematics.errors import NotFiniteError
from tri_glide_kinematics.picking import (
    BeltState,
    Lessons,
    NotEnoughError,
    NotNowError,
    Observed,
    Scene,
    TaughtBelt,
    TaughtCamera,
    TeachingError,
    View,
    teach_belt,
    teach_camera,
    teach_gripper,
    teach_latency,
)
from tri_glide_kinematics.settings import PICK_NODE, taught_of, taught_values

NOISE = 0.0002
CORNERS = ((0.0, 0.0, 0.0), (0.2, 0.0, 0.01), (0.2, 0.15, 0.0), (0.0, 0.15, 0.02))


@dataclass
class Cell:
    """A belt, a camera and a gripper, and how well a person teaches them."""

    rng: np.random.Generator
    per_count: np.ndarray  # m
    rotation: np.ndarray
    shift: np.ndarray  # m
    scale: float  # m for a unit of the camera
    latency: float  # s
    noise: float = 0.0  # m

    @classmethod
    def random(cls, number, noise=0.0):
        rng = np.random.default_rng(number)
        per_count = rng.normal(size=3) * (1.0, 1.0, 0.05)
        per_count *= 10.0 ** rng.uniform(-6.0, 0.0) / np.linalg.norm(per_count)
        scale = 10.0 ** rng.uniform(-4.0, 0.0)
        turn, shift = rotation_by(rng.normal(size=3)), rng.uniform(-1.0, 1.0, 3)
        return cls(rng, per_count, turn, shift, scale, rng.uniform(0.0, 0.15), noise)

    @property
    def true_belt(self):
        size = float(np.linalg.norm(self.per_count))
        return TaughtBelt(tuple(self.per_count / size), size, 0.0)

    def touched(self, part, metres):
        """Touch a part that was at its place when the counter was 0."""
        counts = metres / self.true_belt.metres_per_count
        place = part + counts * self.per_count + self.rng.normal(0.0, self.noise, 3)
        return Observed(tuple(place), counts)

    def seen(self, part, metres, speed=0.0):
        """See it; the stamp is late, and the counts and their rate are those of the stamp."""
        counts, rate = (number / self.true_belt.metres_per_count for number in (metres, speed))
        place = part + (counts - self.latency * rate) * self.per_count
        place = place + self.rng.normal(0.0, self.noise, 3) - self.shift
        return Observed(tuple(self.rotation.T @ place / self.scale), counts, rate)

    def belt(self, ways=(0.0, 0.2), **given):
        return teach_belt([self.touched((0.1, -0.05, 0.2), way) for way in ways], **given)

    def camera_latency(self, speeds=(0.1, 0.3), ways=(-0.2, -0.1, 0.0, 0.1), **given):
        views = [self.seen((0.1, 0.05, 0.2), way, speed) for speed in speeds for way in ways]
        return teach_latency(views, self.true_belt, **given)

    def parts(self, places=CORNERS):
        """See parts at ``places``, with the belt at speed, and touch them 0.1 m later."""
        late = 0.1 * self.latency
        return [(self.seen(p, late, 0.1), self.touched(p, 0.1)) for p in np.array(places)]

    def camera(self, places=CORNERS, **given):
        return teach_camera(self.parts(places), self.true_belt, self.latency, **given)


@reproducible
@given(st.integers(0, 2**32 - 1))
def test_exact_observations_give_what_there_is(number):
    cell = Cell.random(number)
    for belt in (cell.belt(), cell.belt((0.1, -0.1, 0.0, 0.05))):
        assert belt.direction == pytest.approx(cell.true_belt.direction, abs=1e-10)
        assert belt.metres_per_count == pytest.approx(cell.true_belt.metres_per_count, rel=1e-9)
    for speeds in ((0.05, 0.5), (0.0, 0.2), (-0.1, 0.1, 0.3)):
        assert cell.camera_latency(speeds).latency == pytest.approx(cell.latency, abs=1e-9)
    camera = cell.camera()
    # As a parameter file has it.
    camera = TaughtCamera(camera.position, camera.roll_pitch_yaw, camera.scale)
    assert camera.place_of((0.0, 0.0, 0.0)) == pytest.approx(cell.shift, abs=1e-9)
    assert camera.rotation == pytest.approx(cell.rotation, abs=1e-9)
    assert camera.scale == pytest.approx(cell.scale, rel=1e-9)
    marks = cell.rng.uniform(-0.1, 0.1, (3, 3))
    gripper = teach_gripper([(mark, mark - (0.01, 0.0, -0.12)) for mark in marks])
    assert gripper.offset == pytest.approx((0.01, 0.0, -0.12), abs=1e-12)


def belt_error(cell, **given):
    belt = cell.belt(**given)
    end = np.array(belt.direction) * belt.metres_per_count - cell.per_count
    return end / cell.true_belt.metres_per_count, belt.deviation


def latency_error(cell, **given):
    taught = cell.camera_latency(**given)
    return np.array([taught.latency - cell.latency]), taught.deviation


def camera_error(cell, **given):
    """The deviation is that of the corner where it is largest."""
    camera = cell.camera(**given)
    seen = cell.rotation.T @ (CORNERS[-1] - cell.shift) / cell.scale
    return np.array(camera.place_of(tuple(seen))) - CORNERS[-1], camera.deviation


def gripper_error(cell, touches=3, **given):
    marks = cell.rng.normal(0.0, cell.noise, (touches, 3))
    gripper = teach_gripper([(mark, np.zeros(3)) for mark in marks], **given)
    return np.array(gripper.offset), gripper.deviation


MANY_PARTS = [(x, y, z) for x in (0.0, 0.2) for y in (0.0, 0.15) for z in (0.0, 0.01, 0.02)]
ALL = {"noise": 1e-6, "allowed": 1.0}


@pytest.mark.parametrize(
    ("error_of", "given"),
    [
        (belt_error, {}),
        (belt_error, {"ways": np.linspace(0.0, 0.2, 8), **ALL}),
        (latency_error, {}),
        (latency_error, {"ways": np.linspace(-0.2, 0.1, 12), "speeds": (0.05, 0.45), **ALL}),
        (camera_error, {}),
        (camera_error, {"places": MANY_PARTS, **ALL}),
        (gripper_error, {}),
        (gripper_error, {"touches": 8, **ALL}),
    ],
)
def test_errors_are_as_large_as_the_deviation_tells(error_of, given):
    """That comes from the stated noise, or from the residuals alone."""
    taught = [error_of(Cell.random(seed(number), NOISE), **given) for number in range(many(300))]
    ratios = np.array([error / deviation for error, deviation in taught])
    assert (np.abs(ratios) <= 3.0).all(axis=1).mean() >= 0.95
    assert 0.7 < math.sqrt((ratios**2).mean()) < 1.2


CELL = Cell(np.random.default_rng(1), np.array([1e-4, 0.0, 0.0]), np.eye(3), np.zeros(3), 1.0, 0.05)
TOUCHES = [CELL.touched((0.1, 0.0, 0.2), way) for way in (0.0, 0.1, 0.2, 0.3)]
VIEWS = [CELL.seen((0, 0, 0), way, speed) for speed in (0.1, 0.3) for way in (0.0, 0.1, 0.2)]
PARTS = CELL.parts()


def belt(touch, way):
    return teach_belt([*TOUCHES, CELL.touched(touch, way)])


def latency(view, way):
    return teach_latency([*VIEWS, CELL.seen(view, way, 0.3)], CELL.true_belt)


def camera(parts):
    return teach_camera(parts, CELL.true_belt, CELL.latency)


def mirrored(view):
    return Observed((-view.position[0], *view.position[1:]), view.counts, view.rate)


@pytest.mark.parametrize(
    ("teach", "error", "text"),
    [
        (lambda: CELL.belt((0.1,)), NotEnoughError, "touches of a mark: 1, at least 2"),
        (lambda: CELL.belt((0.1, 0.1)), NotEnoughError, "touches: 0 m, at least 0.01 m"),
        (lambda: CELL.belt((0.1, 0.12)), NotEnoughError, "its way: 0.0141, at most 0.003"),
        (lambda: belt((0.12, 0, 0.2), 0.1), TeachingError, "touch 5 .* m, at most 0.005 m"),
        (lambda: belt((0.1, 0.01, 0.2), 0.1), TeachingError, "touch 5 .* m, at most 0.005 m"),
        (lambda: CELL.camera_latency(ways=(0,)), NotEnoughError, "of a part: 2, at least 4"),
        (
            lambda: CELL.camera_latency((0.1, 0.109)),
            NotEnoughError,
            "0.0045 m/s, at least 0.01 m/s",
        ),
        (lambda: CELL.camera_latency((0.1, 0.1)), NotEnoughError, " m/s, at least 0.01 m/s"),
        (lambda: CELL.camera_latency(ways=(0, 0)), NotEnoughError, "views: 0 m, at least 0.01 m"),
        (lambda: CELL.camera_latency((0.1, 0.13)), NotEnoughError, " s, at most 0.002 s"),
        (lambda: latency((0.03, 0.0, 0.0), 0.1), TeachingError, "view 7 .* m, at most 0.005 m"),
        (lambda: camera(PARTS[:3]), NotEnoughError, "seen and touched: 3, at least 4"),
        (lambda: CELL.camera(np.eye(4, 3) * (1, 0, 0)), NotEnoughError, " m, at least 0.01 m"),
        (lambda: CELL.camera(noise=0.002), NotEnoughError, r"0.00\d+ m, at most 0.001 m"),
        (lambda: camera([*PARTS, (VIEWS[0], TOUCHES[0])]), TeachingError, "m, at most 0.005 m"),
        (lambda: camera([(PARTS[0][0], touch) for _, touch in PARTS]), TeachingError, "at most"),
        (lambda: camera([(mirrored(v), t) for v, t in PARTS]), TeachingError, "at most 0.0006"),
        (lambda: teach_gripper([]), NotEnoughError, "touches of marks: 0, at least 1"),
        (
            lambda: teach_gripper(np.diag((0.0, 0.02))[..., None] * np.ones(3)),
            TeachingError,
            "0.0173",
        ),
        (lambda: teach_gripper(np.zeros((1, 2, 3)), 0.001), NotEnoughError, "0.001 m, at most 0"),
        (lambda: CELL.camera(noise=math.nan), NotFiniteError, "noise"),
    ],
)
def test_what_cannot_be_taught_is_told_with_the_number_and_the_bound(teach, error, text):
    with pytest.raises(error, match=text) as raised:
        teach()
    assert raised.type is error


@pytest.mark.parametrize("pitch", [0.5 * math.pi, -0.5 * math.pi])
def test_a_camera_that_looks_along_the_belt_has_angles_too(pitch):
    rotation = rotation_by(np.array([0.0, 0.0, 1.0])) @ rotation_by(np.array([0.0, pitch, 0.0]))
    camera = Cell(CELL.rng, CELL.per_count, rotation, CELL.shift, 1.0, 0.0).camera()
    assert camera.rotation == pytest.approx(rotation, abs=1e-9)


def test_a_picture_without_depth_may_be_a_mirror_image():
    cell = Cell(CELL.rng, CELL.per_count, np.diag([1.0, -1.0, 1.0]), np.zeros(3), 1e-3, 0.0)
    camera = cell.camera([(x, y, 0.0) for x, y, _ in CORNERS])
    assert np.linalg.det(camera.rotation) == pytest.approx(1.0)
    assert camera.place_of((100.0, -70.0, 0.0)) == pytest.approx((0.1, 0.07, 0.0), abs=1e-9)


def test_lessons_are_taken_in_their_order_and_each_is_used_by_those_after_it():
    """Each step changes what it teaches, and nothing else; what cannot be now is refused."""
    values = {each.name: each.default for each in PICK_NODE}
    cell, lessons = taught_of(values), Lessons()
    assert taught_of({**values, **taught_values(cell)}) == cell

    def taught(what, platform=None, way=None, mark=(0.0, 0.0, 0.0)):
        belt = None if way is None else BeltState(way, 0.0, 0.0)
        return lessons.teach(what, cell, Scene(10.0, platform, belt, mark))

    for what, platform, way, text in (
        ("gripper", None, 0.0, "must rest"),
        ("belt", (0.0, 0.0, 0.3), None, "position of the belt"),
        ("camera", (0.0, 0.0, 0.3), 0.0, "no picture"),
        ("colour", (0.0, 0.0, 0.3), 0.0, "gripper, belt, latency, camera or forget"),
    ):
        with pytest.raises(NotNowError, match=text):
            taught(what, platform, way)
    cell, text = taught("gripper", (0.1, 0.0, 0.3), mark=(0.1, 0.01, 0.25))
    assert cell.point == pytest.approx((0.0, 0.01, -0.05)) and "point of the gripper" in text
    with pytest.raises(NotEnoughError):
        taught("belt", (0.0, 0.0, 0.3), 0.0)
    assert taught("forget")[0] is cell
    for way in (0.0, 0.2):
        with suppress(NotEnoughError):
            cell, text = taught("belt", (0.0, 0.5 * way, 0.3), way)
    assert cell.belt.direction == pytest.approx((0.0, 1.0, 0.0))
    assert cell.belt.metres_per_count == pytest.approx(0.5) and "0.5 m for 1" in text
    for speed in (0.0, 0.2):
        for number in range(4):
            way = 0.02 * number
            seen = Observed((0.0, 0.5 * (way - 0.05 * speed), 0.0), way, speed)
            lessons.see(View("camera", 9.0, seen))
        with suppress(NotEnoughError):
            cell, text = taught("latency")
    assert cell.cameras["camera"].latency == pytest.approx(0.05, abs=1e-6) and "latency" in text
    for x, y in ((0.0, 0.0), (0.1, 0.0), (0.0, 0.1), (0.1, 0.1)):
        lessons.see(View("camera", 9.5, Observed((x, y, 0.0), 0.0)))
        with suppress(NotEnoughError):
            cell, text = taught("camera", (x + 0.02, y - 0.01, 0.3), 0.0)
    assert cell.cameras["camera"].place_of((0.1, 0.0, 0.0)) == pytest.approx((0.12, 0.0, 0.25))
    assert taught_of({**values, **taught_values(cell)}).cameras.keys() == cell.cameras.keys()
