"""Values of parameters become geometry, limits and bounds, or are refused as a set."""

import numpy as np
import pytest

from tri_glide_kinematics.dynamics import Arm, Masses, SliderForces
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.limits import ForceLimits, PlatformSpeedLimit
from tri_glide_kinematics.motion.shaping import Mode, Shaper, ShaperByPlace, ShaperKind
from tri_glide_kinematics.settings import (
    IK_NODE,
    PICK_NODE,
    SIMULATOR_NODE,
    check_joint_names,
    check_travel,
    forces_of,
    in_position_bounds_of,
    limits_of,
    machine_of,
    motion_limits_of,
    shaper_of,
    supervision_bounds_of,
    swing_of,
    taught_in,
    taught_of,
    true_travel_of,
    workspace_limits_of,
)
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide

POSITION = (0.03, -0.02, 0.25)


def values(table=IK_NODE, **changes):
    return {**{entry.name: entry.default for entry in table}, **changes}


def held(values):
    """Check that the limits of these values can hold the weight."""
    motion_limits_of(values, MACHINE).check_holding(np.array((POSITION,)))


def shaped(values):
    """Make a shaper of these values, of whatever kind they are."""
    return shaper_of({**values, "shaper": "ei"})


def swing_by(**changes):
    return swing_of(values(SIMULATOR_NODE, **changes))


@pytest.mark.parametrize("geometry", ["symmetric", "calibrated"])
def test_the_defaults_are_the_default_machine_either_way(geometry):
    machine = machine_of(values(geometry=geometry))
    expected = TriGlide(DEFAULT_GEOMETRY).inverse(POSITION)
    assert machine.inverse(POSITION) == pytest.approx(expected, abs=1e-8)


def test_limits_are_those_of_the_parameters():
    limits = limits_of(values(velocity_limits=(1.0, 2.0, 3.0)))
    assert limits.velocity == (1.0, 2.0, 3.0)
    assert supervision_bounds_of(values(velocity_limits=(1.0, 2.0, 3.0))).velocity == (1, 2, 3)


MACHINE = TriGlide(DEFAULT_GEOMETRY)
WEIGHED = {"carriage_masses": (2.0, 2.0, 2.5), "platform_mass": 1.0}


def test_by_default_nothing_is_known_of_forces_and_nothing_is_added_to_the_limits():
    assert forces_of(values(), MACHINE) is None
    assert motion_limits_of(values(), MACHINE) == limits_of(values())


def test_masses_become_forces():
    changed = values(
        **WEIGHED,
        arm_masses=(0.3, 0.2, 0.1),
        arm_centres=(0.5, 0.6, 0.5),
        arm_inertias=(0.0, 0.004, 0.0),
        payload=0.5,
        counterweight_masses=(0.1, 0.2, 0.3),
        coulomb_friction=(1.0, 2.0, 3.0),
        viscous_friction=(4.0, 5.0, 6.0),
        gravity=(1.0, 0.0, -9.0),
    )
    masses = Masses(
        (2.0, 2.0, 2.5),
        (Arm(0.3), Arm(0.2, 0.6, 0.004), Arm(0.1)),
        1.0,
        0.5,
        counterweights=(0.1, 0.2, 0.3),
        coulomb=(1.0, 2.0, 3.0),
        viscous=(4.0, 5.0, 6.0),
        gravity=(1.0, 0.0, -9.0),
    )
    assert forces_of(changed, MACHINE).masses == masses


def test_bounds_that_are_set_are_added_to_the_limits():
    changed = values(**WEIGHED, platform_speed_limit=0.5, force_limit_up=(90.0, 0.0, 80.0))
    forces = SliderForces(MACHINE, forces_of(changed, MACHINE).masses)
    none = 1e6
    assert motion_limits_of(changed, MACHINE).added == (
        PlatformSpeedLimit(MACHINE, 0.5),
        ForceLimits(forces, (90.0, none, 80.0), (none, none, none)),
    )


ANYWHERE = (0.0, 0.0, 0.0)
TWO_PLACES = (0.0, 0.0, 0.2, 0.1, 0.0, 0.3)
LOW_AND_HIGH = (0.0, 0.0, 0.2, 0.0, 0.0, 0.4)


@pytest.mark.parametrize(
    ("kind", "places", "frequencies", "dampings", "modes"),
    [
        ("ei", ANYWHERE, (20.0,), (0.03,), [Mode(20.0, 0.03)]),
        ("zv", ANYWHERE, (20.0, 30.0), (0.1,), [Mode(20.0, 0.1), Mode(30.0, 0.1)]),
        # One place stands for all.
        ("zv", (0.1, 0.0, 0.3), (20.0,), (0.05,), [Mode(20.0, 0.05)]),
    ],
)
def test_a_shaper_is_made_of_its_kind_and_the_modes(kind, places, frequencies, dampings, modes):
    changed = values(
        shaper=kind, mode_places=places, mode_frequencies=frequencies, mode_dampings=dampings
    )
    assert shaper_of(changed) == Shaper.of(ShaperKind(kind), *modes)


def test_by_default_nothing_is_shaped():
    assert shaper_of(values()) is None


@pytest.mark.parametrize(
    ("kind", "frequencies", "dampings", "modes"),
    [
        ("zvd", (12.0, 18.0), (0.02, 0.04), [(Mode(12.0, 0.02),), (Mode(18.0, 0.04),)]),
        (
            "ei",
            (12.0, 30.0, 18.0, 40.0),
            (0.05,),
            [(Mode(12.0, 0.05), Mode(30.0, 0.05)), (Mode(18.0, 0.05), Mode(40.0, 0.05))],
        ),
    ],
)
def test_modes_are_told_place_by_place(kind, frequencies, dampings, modes):
    changed = values(
        shaper=kind, mode_places=TWO_PLACES, mode_frequencies=frequencies, mode_dampings=dampings
    )
    places = ((0.0, 0.0, 0.2), (0.1, 0.0, 0.3))
    assert shaper_of(changed) == ShaperByPlace(ShaperKind(kind), places, tuple(modes))


def test_travel_is_given_as_reported_and_used_as_it_truly_is():
    changed = values(height_offsets=(0.001, -0.002, 0.0))
    lower, upper = true_travel_of(changed)
    assert lower == pytest.approx((0.301, 0.298, 0.3))
    assert upper == pytest.approx((0.901, 0.898, 0.9))
    limits = workspace_limits_of(changed)
    assert (limits.lower_heights, limits.upper_heights) == (lower, upper)


@pytest.mark.parametrize("space", ["unlimited", "box", "cylinder"])
def test_only_the_chosen_shape_limits_the_space(space):
    limits = workspace_limits_of(values(space=space))
    assert (limits.box_lower is not None) == (limits.box_upper is not None) == (space == "box")
    assert (limits.cylinder is not None) == (space == "cylinder")


def test_by_default_nothing_swings():
    assert swing_by().modes == ()


def test_frequencies_are_told_point_by_point_for_one_mode_or_two():
    one = swing_by(swing_frequencies=(15.0, 0.0, 30.0), swing_dampings=(0.01, 0.02, 0.03))
    assert [(mode.axis, mode.frequencies, mode.damping) for mode in one.modes] == [
        (0, (15.0,), 0.01),
        (2, (30.0,), 0.03),
    ]
    two = swing_by(
        swing_points=LOW_AND_HIGH,
        swing_frequencies=(10.0, 11.0, 0.0, 20.0, 0.0, 0.0, 12.0, 13.0, 0.0, 22.0, 0.0, 0.0),
        swing_shares=(0.7, 1.0, 1.0, 0.3, 1.0, 1.0),
    )
    assert two.points == ((0.0, 0.0, 0.2), (0.0, 0.0, 0.4))
    assert [(mode.axis, mode.frequencies, mode.share) for mode in two.modes] == [
        (0, (10.0, 12.0), 0.7),
        (1, (11.0, 13.0), 1.0),
        (0, (20.0, 22.0), 0.3),
    ]


WRONG_MODES = [
    ({"mode_frequencies": (8.0, 20.0, 30.0)}, "has 3 elements, expected 1 to 2"),
    ({"mode_places": TWO_PLACES}, "has 1 elements, expected 1 to 2 for each of 2 places"),
    (
        {"mode_places": TWO_PLACES, "mode_frequencies": (8.0, 20.0, 30.0)},
        "mode_frequencies has 3 elements, expected 1 to 2 for each of 2 places",
    ),
    (
        {"mode_places": TWO_PLACES, "mode_frequencies": (8.0, 9.0)} | {"mode_dampings": (0.1,) * 3},
        "mode_dampings has 3 elements, expected 1 or 2",
    ),
    ({"mode_places": (0.1, 0.2)}, "mode_places has 2 elements, expected three for each"),
    (
        {"mode_places": (0.0,) * 6, "mode_frequencies": (8.0, 9.0)},
        "distance of place 1 from place 2 = 0 m must be at least 0.001",
    ),
    ({"mode_dampings": (0.1, 0.1)}, "mode_dampings has 2 elements, expected 1"),
]
# By what is made of the values: some of them, and what is said of these.
REFUSED = {
    machine_of: [({"arm_length": 0.001}, "arm")],
    limits_of: [({"jerk_limits": (1.0, 0.0, 1.0)}, "jerk[1] = 0 m/s^3")],
    in_position_bounds_of: [
        (
            {"position_tolerance": 0.01},
            "position_tolerance = 0.01 m must be at most position_error_limit = 0.005 m",
        ),
        ({"settling_time": 2.0}, "settling_time = 2 s must be at most settling_timeout = 1 s"),
    ],
    workspace_limits_of: [({"space": "box", "box_lower": (0.2, 0.0, 0.0)}, "0.2")],
    check_travel: [
        (
            {"lower_heights": (0.3, 0.9, 0.3)},
            "lower_heights[1] = 0.9 m must be less than upper_heights[1] = 0.9 m",
        )
    ],
    check_joint_names: [
        ({"joint_names": ("a", "b", "a")}, "three different names"),
        ({"joint_names": ("a", "", "c")}, "three different names"),
    ],
    held: [
        ({"force_limit_down": (9.0, 0.0, 0.0)}, "force_limit_down = [9, 0, 0] N needs masses"),
        ({"payload": 1.0}, "carriage_masses[0] = 0 kg must be greater than 0 kg, as payload = 1"),
        ({"carriage_masses": (1.0, 1.0, 1.0)}, "platform_mass = 0 kg must be greater than 0 kg"),
        ({**WEIGHED, "arm_centres": (0.5, 0.6, 0.5)}, "arm centre = 0.6 must be 0.5 for a uniform"),
        ({**WEIGHED, "force_limit_up": (60.0, 20.0, 60.0)}, "force_limit_up[1] = 20 N cannot hold"),
    ],
    taught_of: [
        ({"cameras": ("a", "b", "a")}, "cameras = (a, b, a) must have each name once"),
        ({"cameras": ("a", "b")}, "camera_places has 3 elements, expected 6"),
    ],
    shaper_of: WRONG_MODES,
    shaped: WRONG_MODES,
    swing_of: [
        ({"swing_points": (0.0, 0.0)}, "swing_points has 2 elements, expected three for each"),
        ({"swing_frequencies": (15.0,)}, "has 1 elements, expected 3 or 6 for each of 1 points"),
        ({"swing_points": (0.0,) * 5 + (0.1,)}, "expected 3 or 6 for each of 2 points"),
        ({"swing_points": (0.0,) * 6, "swing_frequencies": (9.0,) * 6}, "must be different"),
        ({"swing_frequencies": (0.5, 0.0, 0.0)}, "swing_frequencies[0] = 0.5 Hz must be at least"),
        (
            {"swing_points": LOW_AND_HIGH, "swing_frequencies": (9.0, 0.0, 9.0, 9.0, 0.0, 0.0)},
            "swing_frequencies[5] = 0 Hz must be at least 1 Hz, or 0 at each of the points",
        ),
        ({"swing_frequencies": (1e-300, 0.0, 0.0)}, "swing_frequencies[0] = 1e-300 Hz must be at"),
        ({"swing_dampings": (0.1, 0.1)}, "swing_dampings has 2 elements, expected 1 or 3"),
        ({"swing_shares": (1.0,) * 6}, "swing_shares has 6 elements, expected 1 or 3"),
        ({"swing_frequencies": (9.0,) * 6}, "sum of the shares along x = 2 must be at most 1"),
    ],
}


@pytest.mark.parametrize(
    ("check", "changes", "words"),
    [(check, *case) for check, cases in REFUSED.items() for case in cases],
)
def test_values_that_do_not_fit_together_are_refused_by_name_and_number(check, changes, words):
    table = {swing_of: SIMULATOR_NODE, taught_of: PICK_NODE}.get(check, IK_NODE)
    check(values(table))
    with pytest.raises(KinematicsError) as refused:
        check(values(table, **changes))
    assert words in str(refused.value)


def test_a_taught_file_that_cannot_be_used_is_named_with_the_reason(tmp_path):
    file = tmp_path / "taught.yaml"
    assert taught_in(file) == {}
    file.write_text("metres_per_count: 2\nother: 1")
    assert taught_in(file) == {"metres_per_count": 2.0}
    for text, reason in (
        ("", "holds no names"),
        ("a: [", "expected"),
        ("\0", "not allowed"),
        ("metres_per_count: 11", "at most 10 m"),
        ("gripper_point: [0, 0]", "has 2 elements"),
    ):
        file.write_text(text)
        with pytest.raises(KinematicsError, match=f"(?s)taught.yaml cannot be used: .*{reason}"):
            taught_in(file)
    with pytest.raises(KinematicsError, match="too long"):
        taught_in(tmp_path / ("x" * 300))
