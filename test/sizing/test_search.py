"""Machines for wishes: all that is said of them holds, and none is better."""

import contextlib
import math
from dataclasses import replace

import numpy as np
import pytest
from sized_machines import (
    largest_forces,
    part_of_force,
    random_places,
    random_wish,
    refused,
    slider_motion,
)
from soak import many, seed, some

from tri_glide_kinematics.dynamics import SliderForces
from tri_glide_kinematics.errors import KinematicsError, NotAChoiceError
from tri_glide_kinematics.sizing import (
    Box,
    Demand,
    ImpossibleWishError,
    Objective,
    Wish,
    field_bounds,
    needs,
    search,
    size,
    sizing_of,
    some_places,
)
from tri_glide_kinematics.workspace import Cylinder

WISH = Wish(Cylinder(0.0, 0.0, 0.12, 0.1, 0.25), 1.0, 10.0, payload=0.2)
WISHES = {
    "fine": replace(WISH, platform_resolution=1.5e-5, max_condition_number=3.0),
    "low": replace(WISH, largest_column_height=0.55, largest_slider_speed=2.2),
    "a box in a corner": replace(WISH, volume=Box((0.02, 0.01, 0.0), (0.12, 0.1, 0.2))),
    "a flat box": replace(WISH, volume=Box((-0.2, -0.03, 0.0), (0.2, 0.03, 0.05)), orientation=0.3),
    "heavy arms": replace(WISH, arm_density=4.0, largest_force=150.0),
    "tiny": replace(
        WISH, volume=Cylinder(0.0, 0.0, 0.005, 0.0, 0.005), clearance=0.001, platform_radius=0.003
    ),
}
OBJECTIVES = {"a box in a corner": Objective.POWER, "heavy arms": Objective.POWER}


def search_roughly(monkeypatch):
    monkeypatch.setattr(search, "ROUNDS", 9)
    monkeypatch.setattr(search, "STARTS", 1)
    monkeypatch.setattr(search, "FIRST_GRID", 31)


@pytest.mark.slow
@pytest.mark.parametrize("name", some([*WISHES], 2))
def test_a_machine_does_what_is_wished_and_none_is_better(name):
    wish, objective = WISHES[name], OBJECTIVES.get(name, Objective.SIZE)
    sizing = size(wish, objective)
    assert sizing.worst <= 1.0
    assert sizing.condition_number <= wish.max_condition_number
    assert sizing.base_radius - sizing.platform_radius >= wish.clearance
    for demand, value in (
        (Demand.COLUMN_HEIGHT, sizing.column_height),
        (Demand.FORCE, sizing.force),
        (Demand.SLIDER_SPEED, sizing.slider_speed),
        (Demand.RESOLUTION, sizing.platform_resolution),
    ):
        allowed = getattr(wish, demand.value)
        assert allowed is None or value <= allowed * (1.0 + 1e-12)
    rng = np.random.default_rng(5)
    assert_holds(sizing, rng)
    lower, upper = sizing.travel
    for place in random_places(wish, rng, 30).tolist():
        heights = sizing.machine.inverse(place)
        assert min(heights) >= lower + wish.end_margin - 1e-9
        assert max(heights) <= upper - wish.end_margin + 1e-9
        direction, pull = rng.normal(size=(2, 3))
        velocity = wish.speed * direction / np.linalg.norm(direction)
        acceleration = wish.acceleration * pull / np.linalg.norm(pull)
        speeds, accelerations = slider_motion(sizing.machine, place, velocity, acceleration)
        assert np.abs(speeds).max() <= sizing.slider_speed * (1.0 + 1e-9)
        assert np.abs(accelerations).max() <= sizing.slider_acceleration * (1.0 + 1e-9)
    assert least_of_many(wish, objective, rng) > 0.99 * sizing.needs.of(objective)[0]


def assert_holds(sizing, rng):
    """No place needs more than the proved force, and none is refused."""
    assert part_of_force(sizing, rng) <= 1.0 + 1e-9
    assert refused(sizing, rng) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", some(range(3, 300), 1))
def test_what_is_said_of_a_machine_holds_for_any_wish(number):
    rng = np.random.default_rng((seed(1), number))
    with contextlib.suppress(ImpossibleWishError):
        assert_holds(size(random_wish(rng), tuple(Objective)[number % 2]), rng)


def test_no_direction_needs_more_than_the_largest_force_and_one_needs_nearly_as_much():
    sizing = sizing_of(replace(WISH, speed=1.5, arm_density=2.0), 0.2, 0.4)
    place = np.array((0.08, -0.05, 0.2))
    allowed = float(largest_forces(sizing, place[np.newaxis])[0])
    directions = np.random.default_rng(3).normal(size=(2, 30000, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    sliders = slider_motion(sizing.machine, place, 1.5 * directions[0], 10.0 * directions[1])
    heights = np.tile(sizing.machine.inverse(place), (30000, 1))
    forces = SliderForces(sizing.machine, sizing.masses).forces_batch(heights, *sliders)
    assert 0.95 * allowed < np.abs(forces).max() <= allowed * (1.0 + 1e-12)


def least_of_many(wish, objective, rng):
    """The least objective among machines at random that do what is wished at some places."""
    count, places = many(800), some_places(wish.volume)
    extent = np.hypot(*places.T).max()
    differences = extent * np.exp(rng.uniform(np.log(0.05), np.log(10.0), count))
    lengths = np.hypot(differences, extent) * np.exp(rng.uniform(0.0, 1.5, count))
    number = len(places)
    tried = field_bounds(
        wish,
        np.repeat(differences, number),
        np.repeat(lengths, number),
        np.tile(places, (count, 1)),
        0.0,
    )
    found = needs(wish, differences, lengths, tried.reshape(3, count, number).max(axis=2))
    return found.of(objective)[found.worst <= 1.0].min(initial=np.inf)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("loosened", "expected"),
    some(
        [
            ({"largest_base_radius": 0.15}, {Demand.BASE_RADIUS, Demand.ARM_ANGLE}),
            ({"largest_force": 8.0}, {Demand.FORCE}),
        ],
        1,
    ),
)
def test_an_impossible_wish_is_told_with_the_nearest_possible_one(monkeypatch, loosened, expected):
    # What comes nearest is not far larger or smaller than the volume.
    monkeypatch.setattr(search, "DIFFERENCES", search.DIFFERENCES[:1])
    search_roughly(monkeypatch)
    wish = replace(WISH, **loosened)
    with pytest.raises(ImpossibleWishError, match="no machine does all that is wished") as caught:
        size(wish)
    error = caught.value
    assert expected <= {stop.demand for stop in error.stops}
    for stop in error.stops:
        assert getattr(wish, stop.demand.value) == stop.wanted
        assert getattr(error.nearest, stop.demand.value) == stop.possible
        assert stop.demand.value in str(error)
    assert size(error.nearest).worst <= 1.0
    # Half of what they are loosened by is not enough.
    halfway = wish
    for stop in error.stops:
        ratio = stop.possible / stop.wanted
        value = stop.wanted * (1.0 + 0.5 * (ratio - 1.0))
        halfway = replace(halfway, **{stop.demand.value: value})
    with pytest.raises(ImpossibleWishError):
        size(halfway)


@pytest.mark.slow
@pytest.mark.parametrize(
    "far",
    some(
        [
            {"volume": Cylinder(0.0, 0.0, 0.001, 0.1, 0.11)},
            {"max_condition_number": 1.05},
            {"clearance": 2.0},
            {"max_condition_number": 1.3},
        ],
        1,
    ),
)
def test_a_machine_far_larger_than_the_volume_is_found(far):
    wish = replace(WISH, **far)
    sizing = size(wish)
    assert sizing.worst <= 1.0
    extent = wish.volume.radius
    assert sizing.base_radius - sizing.platform_radius > 10.0 * extent


@pytest.mark.slow
@pytest.mark.parametrize(
    ("impossible", "demand"),
    some(
        [
            ({"max_condition_number": 1.0001}, Demand.CONDITION),
            ({"least_arm_angle": math.radians(89.0)}, Demand.ARM_ANGLE),
            ({"largest_base_radius": 0.0501}, Demand.BASE_RADIUS),
        ],
        1,
    ),
)
def test_a_wish_that_nothing_comes_near_to_is_told_with_its_demand(monkeypatch, impossible, demand):
    search_roughly(monkeypatch)
    with pytest.raises(ImpossibleWishError, match=demand.value) as caught:
        size(replace(WISH, **impossible))
    assert size(caught.value.nearest).worst <= 1.0


def test_a_machine_that_does_not_do_what_is_wished_is_judged_too():
    short = sizing_of(WISH, 0.25, 0.29)
    assert short.worst == math.inf
    assert short.condition_number == math.inf
    flat = sizing_of(WISH, 0.25, 0.33)
    assert 1.0 < flat.worst < math.inf
    assert Demand.ARM_ANGLE in flat.tight


@pytest.mark.parametrize(
    "wrong",
    [
        {"speed": 0.0},
        {"acceleration": math.nan},
        {"volume": "cylinder"},
        {"largest_force": -1.0},
        {"clearance": -0.1},
        {"max_condition_number": 1.0},
        {"least_arm_angle": 2.0},
        {"largest_base_radius": 0.05},
        {"payload": -1.0},
    ],
)
def test_wrong_numbers_are_refused(wrong):
    with pytest.raises(KinematicsError, match=next(iter(wrong))):
        replace(WISH, **wrong)


def test_wrong_boxes_and_objectives_are_refused():
    with pytest.raises(KinematicsError, match=r"box upper\[1\]"):
        Box((0.0, 0.1, 0.0), (0.1, 0.1, 0.1))
    with pytest.raises(NotAChoiceError):
        size(WISH, "size")
