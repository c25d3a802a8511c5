import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError, WrongShapeError
from tri_glide_kinematics.mechanisms.landing_gear import LandingGear, LandingGearMotion

INERTIA = np.array([[9.0, 0.6, -0.8], [0.6, 11.0, 0.4], [-0.8, 0.4, 7.0]])
GOOD = {
    "l1": 1.2,
    "l2": 0.7,
    "l3": 1.5,
    "l4": 0.4,
    "gear_mass": 120.0,
    "wheel_mass": 45.0,
    "gear_inertia": INERTIA,
    "wheel_axial_inertia": 3.2,
    "wheel_transverse_inertia": 1.9,
}
GEAR = LandingGear(**GOOD)
STEP = 1e-3
SHIFTS = STEP * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])


def turn(axis, angle):
    return Rotation.from_rotvec(np.multiply.outer(angle, np.eye(3)["xyz".index(axis)]))


def first_derivative(values):
    return (8.0 * (values[3] - values[1]) - (values[4] - values[0])) / (12.0 * STEP)


def second_derivative(values):
    inner, outer = values[3] + values[1], values[4] + values[0]
    return (16.0 * inner - outer - 30.0 * values[2]) / (12.0 * STEP**2)


class Trajectory:
    """The motion in time that has given rates now, by rotations of scipy; all from positions."""

    def __init__(self, count=2000, seed=1):
        rng = np.random.default_rng(seed)
        self.alpha, self.beta = rng.uniform(-math.pi, math.pi, (2, count))
        self.rates = rng.uniform(-3.0, 3.0, (3, count))
        self.rates2 = rng.uniform(-5.0, 5.0, (3, count))
        self.speed = rng.uniform(-80.0, 80.0, count)
        self.speed_rate = rng.uniform(-5.0, 5.0, count)
        self.motion = LandingGearMotion(
            self.alpha, self.beta, *self.rates, *self.rates2, self.speed, self.speed_rate
        )

    def angles(self, t):
        yaw, retraction, spin = self.rates * t + 0.5 * self.rates2 * t**2
        return yaw, self.beta + retraction, spin

    def rotations(self, t):
        yaw, beta, spin = self.angles(t)
        pitch = turn("x", self.alpha)
        aircraft = pitch * turn("z", yaw)
        gear = aircraft * turn("y", beta)
        return pitch, aircraft, gear, gear * turn("x", -spin)

    def points(self, t, gear_offset, wheel_offset):
        """A point fixed to the gear (from D) and one fixed to the wheel (from C), and B."""
        pitch, aircraft, gear, wheel = self.rotations(t)
        path = self.speed * t + 0.5 * self.speed_rate * t**2
        a = pitch.apply(np.array([0.0, 1.0, 0.0])) * path[:, None]
        b = a + aircraft.apply([GEAR.l1, 0.0, GEAR.l2])
        c = b + gear.apply([-GEAR.l4, 0.0, -GEAR.l3])
        d = c + gear.apply([0.75 * GEAR.l4, 0.0, 0.25 * GEAR.l3])
        return d + gear.apply(gear_offset), c + wheel.apply(wheel_offset), b


@pytest.fixture(scope="module")
def trajectory():
    return Trajectory()


@pytest.fixture(scope="module")
def state(trajectory):
    return GEAR.state(trajectory.motion)


def scaled_error(found, expected):
    return np.abs(found - expected).max() / np.abs(expected).max()


class TestKinematics:
    def test_mass_centres_against_differences_of_positions(self, trajectory, state):
        paths = [trajectory.points(t, [0.0] * 3, [0.0] * 3) for t in SHIFTS]
        for index, body in ((0, state.gear), (1, state.wheel)):
            positions = np.array([points[index] for points in paths])
            assert np.abs(body.position - positions[2]).max() < 1e-14
            assert scaled_error(body.velocity, first_derivative(positions)) < 1e-9
            assert scaled_error(body.acceleration, second_derivative(positions)) < 1e-7

    def test_angular_motion_against_differences_of_rotations(self, trajectory, state):
        """The rotation vector from now has the angular acceleration as its second derivative."""
        for index, body in ((2, state.gear), (3, state.wheel)):
            now = trajectory.rotations(0.0)[index]
            turns = [(trajectory.rotations(t)[index] * now.inv()).as_rotvec() for t in SHIFTS]
            assert scaled_error(body.angular_velocity, first_derivative(turns)) < 1e-9
            assert scaled_error(body.angular_acceleration, second_derivative(turns)) < 1e-7

    def test_coriolis_part_is_what_yaw_and_retraction_make_together(self, trajectory, state):
        """The acceleration with both rates, less with either, plus with none."""
        full = trajectory.motion

        def acceleration(yaw, retraction):
            motion = LandingGearMotion(
                full.pitch_angle, full.retraction_angle, yaw * full.yaw_velocity,
                retraction * full.retraction_velocity,
            )  # fmt: skip
            return GEAR.state(motion).wheel.acceleration

        mixed = acceleration(1, 1) - acceleration(1, 0) - acceleration(0, 1) + acceleration(0, 0)
        assert scaled_error(state.wheel.coriolis_acceleration, mixed) < 1e-13

    def test_one_state_and_many_agree(self, trajectory, state):
        full = trajectory.motion
        values = [np.asarray(getattr(full, name))[17] for name in full.__dataclass_fields__]
        single = GEAR.state(LandingGearMotion(*values))
        assert single.wheel.acceleration.shape == (3,)
        assert single.wheel.acceleration == pytest.approx(state.wheel.acceleration[17], abs=1e-12)
        assert single.hinge.moment == pytest.approx(state.hinge.moment[17], rel=1e-12)
        assert single.hinge.axial_moment.shape == ()

    def test_numbers_and_arrays_mix(self):
        state = GEAR.state(LandingGearMotion(0.1, np.linspace(0.0, 1.5, 7), spin_velocity=30.0))
        assert state.gear.position.shape == (7, 3)
        assert state.wheel.angular_momentum.shape == (7, 3)
        assert state.hinge.axial_moment.shape == (7,)


class TestDynamics:
    def test_momentum_is_mass_times_motion(self, state):
        assert np.array_equal(state.gear.momentum, 120.0 * state.gear.velocity)
        assert np.array_equal(state.wheel.momentum_rate, 45.0 * state.wheel.acceleration)

    def test_rates_of_angular_momentum_against_differences(self):
        """Both angular momenta are followed in time, the rates of the bodies being differences."""
        trajectory = Trajectory(count=1000, seed=4)
        state = GEAR.state(trajectory.motion)
        wheel_inertia = np.diag([3.2, 1.9, 1.9])
        for index, body, inertia in ((2, state.gear, INERTIA), (3, state.wheel, wheel_inertia)):
            momenta = []
            for t in SHIFTS:
                here = trajectory.rotations(t)[index]
                turns = [
                    (trajectory.rotations(t + s)[index] * here.inv()).as_rotvec() for s in SHIFTS
                ]
                omega = first_derivative(turns)
                momenta.append(here.apply(here.inv().apply(omega) @ inertia))
            assert scaled_error(body.angular_momentum, momenta[2]) < 1e-9
            assert scaled_error(body.angular_momentum_rate, first_derivative(momenta)) < 1e-7

    @pytest.mark.slow
    def test_balance_closes_for_clouds_of_point_masses(self, trajectory, state):
        """Both bodies taken apart into point masses, whose paths are differentiated twice.

        No angular momentum and no Euler equation: force and moment are sums over the points.
        """
        gravity = np.array([0.0, 0.0, -9.80665])
        force, moment = np.zeros((2, *trajectory.speed.shape, 3))
        wheel_force, wheel_moment = np.zeros((2, *trajectory.speed.shape, 3))
        b = trajectory.points(0.0, [0.0] * 3, [0.0] * 3)[2]
        c = state.wheel.position
        gear_points = point_masses(120.0, INERTIA)
        wheel_points = point_masses(45.0, np.diag([3.2, 1.9, 1.9]))
        for (gear_mass, gear_offset), (wheel_mass, wheel_offset) in zip(gear_points, wheel_points):
            paths = [trajectory.points(t, gear_offset, wheel_offset) for t in SHIFTS]
            for index, mass in ((0, gear_mass), (1, wheel_mass)):
                positions = np.array([points[index] for points in paths])
                needed = mass * (second_derivative(positions) - gravity)
                force += needed
                moment += np.cross(positions[2] - b, needed)
                if index == 1:
                    wheel_force += needed
                    wheel_moment += np.cross(positions[2] - c, needed)
        assert scaled_error(state.hinge.force, force) < 1e-7
        assert scaled_error(state.hinge.moment, moment) < 1e-7
        assert scaled_error(state.axle.force, wheel_force) < 1e-7
        assert scaled_error(state.axle.moment, wheel_moment) < 1e-6
        assert np.abs(state.hinge.position - b).max() < 1e-14

    def test_axial_moments_are_those_about_the_axes(self, trajectory, state):
        """The retraction turns about y of the gear, the spin about its x, the other way round."""
        gear = trajectory.rotations(0.0)[2]
        for joint, axis in ((state.hinge, (0.0, 1.0, 0.0)), (state.axle, (-1.0, 0.0, 0.0))):
            about = (joint.moment * gear.apply(axis)).sum(axis=1)
            assert scaled_error(joint.axial_moment, about) < 1e-12

    def test_gravity_can_be_turned_off(self):
        weightless = LandingGear(
            1.2, 0.7, 1.5, 0.4, 120.0, 45.0, INERTIA, 3.2, 1.9, (0.0, 0.0, 0.0)
        )
        state = weightless.state(LandingGearMotion(0.4, 0.6, forward_velocity=70.0))
        assert np.abs(state.hinge.force).max() == 0.0
        assert np.abs(state.hinge.moment).max() == 0.0


def point_masses(mass, inertia):
    """Six points about the mass centre that have this mass and this inertia."""
    principal, axes = np.linalg.eigh(inertia)
    spread = np.sqrt(3.0 * (0.5 * principal.sum() - principal) / mass)
    return [
        (mass / 6.0, sign * length * axis)
        for length, axis in zip(spread, axes.T)
        for sign in (-1.0, 1.0)
    ]


class TestErrataOfSource003:
    """What is printed, written out in x y z, against what the differences above confirm."""

    @pytest.fixture
    def terms(self):
        trajectory = Trajectory(count=200, seed=2)
        return trajectory, GEAR.state(trajectory.motion)

    @staticmethod
    def angles(trajectory):
        alpha, beta = trajectory.alpha, trajectory.beta
        return np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)

    def angular_acceleration(self, trajectory, spin_sign, y_factor):
        sa, ca, sb, cb = self.angles(trajectory)
        (wg, wi, ww), (ag, ai, aw) = trajectory.rates, trajectory.rates2
        aw = spin_sign * aw
        x = cb * aw - wg * wi + sb * wi * ww
        y = -sa * ag + ca * ai + sa * sb * aw - ca * cb * wg * ww
        y -= (sa * sb if y_factor == "sin" else sa * cb) * wi * ww
        z = ca * ag + sa * ai - ca * sb * aw - sa * cb * wg * ww + ca * cb * wi * ww
        return np.stack([x, y, z], axis=1)

    def test_total_angular_acceleration(self, terms):
        trajectory, state = terms
        found = state.wheel.angular_acceleration
        assert scaled_error(self.angular_acceleration(trajectory, 1.0, "sin"), found) > 0.1
        assert scaled_error(self.angular_acceleration(trajectory, -1.0, "sin"), found) > 0.1
        assert scaled_error(self.angular_acceleration(trajectory, 1.0, "cos"), found) > 0.1
        assert scaled_error(self.angular_acceleration(trajectory, -1.0, "cos"), found) < 1e-14

    def test_z_component_of_retraction_times_spin(self, terms):
        """Printed with cos(beta)^2 in 2.1.2, with cos(alpha) cos(beta) in the sum below it."""
        trajectory, _ = terms
        sa, ca, sb, cb = self.angles(trajectory)
        _, wi, ww = trajectory.rates
        retraction = np.stack([0.0 * wi, ca * wi, sa * wi], axis=1)
        spin = np.stack([-cb * ww, -sa * sb * ww, ca * sb * ww], axis=1)
        product = np.cross(retraction, spin)[:, 2]
        assert scaled_error(cb * cb * wi * ww, product) > 0.1
        assert scaled_error(ca * cb * wi * ww, product) < 1e-14

    def test_order_of_the_matrices_in_1_3(self):
        """The head of the line has the factors in the order of time, which is another rotation."""
        pitch = turn("x", 0.4).as_matrix()
        retraction = turn("y", 0.7).as_matrix()
        sa, ca, sb, cb = math.sin(0.4), math.cos(0.4), math.sin(0.7), math.cos(0.7)
        result = np.array([[cb, 0.0, sb], [sa * sb, ca, -sa * cb], [-ca * sb, sa, ca * cb]])
        assert np.abs(pitch @ retraction - result).max() < 1e-15
        assert np.abs(retraction @ pitch - result).max() > 0.1

    def test_y_component_of_retraction_times_the_arm_of_d(self, terms):
        """Printed + in 2.5.1, - in the velocity of D below it."""
        trajectory, state = terms
        sa, ca, sb, cb = self.angles(trajectory)
        wi = trajectory.rates[1]
        arm = 0.25 * (3.0 * GEAR.l3 * sb + GEAR.l4 * cb)
        retraction = np.stack([0.0 * wi, ca * wi, sa * wi], axis=1)
        product = np.cross(retraction, state.gear.position - state.hinge.position)[:, 1]
        assert scaled_error(wi * sa * arm, product) > 0.1
        assert scaled_error(-wi * sa * arm, product) < 1e-14

    def test_acceleration_of_d(self, terms):
        """The printed l2 inside the term of omega_i would make the result depend on l2."""
        trajectory, state = terms
        sa, ca, sb, cb = self.angles(trajectory)
        (wg, wi, _), (ag, ai, _) = trajectory.rates, trajectory.rates2
        av, l1, l2, l3, l4 = trajectory.speed_rate, GEAR.l1, GEAR.l2, GEAR.l3, GEAR.l4
        arm, lift = 3.0 * l3 * sb + l4 * cb, l4 * sb - 3.0 * l3 * cb

        def acceleration(extra):
            inner = lift * wi + 4.0 * sa * wg * extra
            x = 0.25 * (wg**2 * (arm - 4.0 * l1) + ai * lift + wi**2 * arm)
            y = av * ca - 0.25 * ag * ca * (arm - 4.0 * l1) + 0.5 * ca * wg * wi * lift
            y += -0.25 * sa * ai * arm + 0.25 * wi * sa * inner
            z = av * sa - 0.25 * ag * sa * (arm - 4.0 * l1) + 0.5 * sa * wg * wi * lift
            z += 0.25 * ca * ai * arm - 0.25 * wi * ca * inner
            return np.stack([x, y, z], axis=1)

        assert scaled_error(acceleration(l2), state.gear.acceleration) > 0.05
        assert scaled_error(acceleration(0.0), state.gear.acceleration) < 1e-13

    def test_coriolis(self, terms):
        """Neither the omega_i of the text nor the sign of the result is right."""
        trajectory, state = terms
        sa, ca, sb, cb = self.angles(trajectory)
        wg, wi, _ = trajectory.rates
        lift = GEAR.l3 * cb - GEAR.l4 * sb
        printed = np.stack(
            [0.0 * lift, 2.0 * ca * wg * wi * lift, 2.0 * sa * wg * wi * lift], axis=1
        )
        assert scaled_error(printed, state.wheel.coriolis_acceleration) > 1.0
        assert scaled_error(-printed, state.wheel.coriolis_acceleration) < 1e-13
        retraction = np.stack([0.0 * wi, ca * wi, sa * wi], axis=1)
        relative = np.cross(retraction, state.wheel.position - state.hinge.position)
        as_in_the_text = -2.0 * np.cross(retraction, relative)
        assert scaled_error(as_in_the_text, printed) > 0.5


class TestBadInput:
    @pytest.mark.parametrize(
        ("name", "value", "error"),
        [
            ("l1", -0.1, OutOfBoundsError),
            ("l3", math.nan, NotFiniteError),
            ("l3", 1e300, OutOfBoundsError),
            ("gear_mass", 0.0, OutOfBoundsError),
            ("wheel_mass", -1.0, OutOfBoundsError),
            ("wheel_axial_inertia", 0.0, OutOfBoundsError),
            ("wheel_axial_inertia", 4.0, OutOfBoundsError),
            ("wheel_transverse_inertia", math.inf, NotFiniteError),
            ("gravity", (0.0, 0.0), WrongShapeError),
            ("gravity", (0.0, math.nan, 0.0), NotFiniteError),
            ("gear_inertia", np.eye(2), WrongShapeError),
            ("gear_inertia", np.diag([1.0, math.nan, 1.0]), NotFiniteError),
            ("gear_inertia", np.diag([1.0, 1.0, 3.0]), OutOfBoundsError),
            ("gear_inertia", np.diag([1.0, 1.0, 0.0]), OutOfBoundsError),
            ("gear_inertia", np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), OutOfBoundsError),
        ],
    )
    def test_gear(self, name, value, error):
        with pytest.raises(error, match=name):
            LandingGear(**{**GOOD, name: value})

    def test_the_bound_of_the_wheel_is_told_in_numbers(self):
        text = r"= 4 kg m\^2 must be at most twice wheel_transverse_inertia, 3.8 kg m\^2"
        with pytest.raises(OutOfBoundsError, match=text):
            LandingGear(**{**GOOD, "wheel_axial_inertia": 4.0})

    def test_inertia_cannot_be_changed_from_outside(self):
        inertia = INERTIA.copy()
        gear = LandingGear(**{**GOOD, "gear_inertia": inertia})
        inertia[0, 0] = 0.0
        assert gear.gear_inertia[0][0] == 9.0
        with pytest.raises(ValueError, match="read-only"):
            gear.gear_inertia[0, 0] = 0.0

    @pytest.mark.parametrize(
        ("numbers", "error", "text"),
        [
            ({"spin_velocity": math.inf}, NotFiniteError, "spin_velocity"),
            ({"spin_velocity": 1e300}, OutOfBoundsError, r"spin_velocity = 1e\+300"),
            ({"retraction_angle": [0.0, math.nan]}, NotFiniteError, r"retraction_angle\[1\]"),
            ({"pitch_angle": [0, 1], "yaw_velocity": [1, 2, 3]}, WrongShapeError, "yaw_velocity"),
            ({"pitch_angle": np.zeros((2, 2))}, WrongShapeError, "pitch_angle"),
        ],
    )
    def test_motion(self, numbers, error, text):
        with pytest.raises(error, match=text):
            GEAR.state(
                LandingGearMotion(**{"pitch_angle": 0.0, "retraction_angle": 0.0, **numbers})
            )


class TestValue:
    def test_gears_with_the_same_numbers_are_equal(self):
        lists = {"gear_inertia": INERTIA.tolist(), "gravity": [0, 0, -9.80665]}
        again = LandingGear(**{**GOOD, **lists})
        assert again == GEAR
        assert hash(again) == hash(GEAR)
        assert GEAR != LandingGear(**{**GOOD, "gear_inertia": 2.0 * INERTIA})
        assert GEAR != LandingGear(**{**GOOD, "l1": 1.3})
        assert GEAR != GOOD

    def test_motions_with_the_same_numbers_are_equal(self):
        motion = LandingGearMotion(0.1, np.array([0.2, 0.3]))
        assert motion == LandingGearMotion(0.1, [0.2, 0.3])
        assert hash(motion) == hash(LandingGearMotion(0.1, [0.2, 0.3]))
        assert motion != LandingGearMotion(0.1, [0.2, 0.4])
        assert motion != LandingGearMotion([0.1, 0.1], [0.2, 0.3])
        state = GEAR.state(motion)
        assert state == state
        assert state != GEAR.state(motion)

    def test_gravity_cannot_be_changed_from_outside(self):
        gravity = [0.0, 0.0, -9.8]
        gear = LandingGear(**{**GOOD, "gravity": gravity})
        gravity[2] = 0.0
        assert gear.gravity == (0.0, 0.0, -9.8)


def test_a_thin_rod_is_refused_however_it_lies():
    rotations = Rotation.random(300, random_state=9).as_matrix()
    for rotation in rotations:
        inertia = rotation @ np.diag([0.0, 2.0, 2.0]) @ rotation.T
        with pytest.raises(OutOfBoundsError, match="smallest principal value"):
            LandingGear(**{**GOOD, "gear_inertia": inertia})


def test_no_instants_give_no_rows():
    state = GEAR.state(LandingGearMotion([], 0.1))
    assert state.hinge.force.shape == (0, 3)
