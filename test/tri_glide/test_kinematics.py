import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from soak import many
from strategies import geometries, nudged, random_geometry, random_positions, reproducible

from tri_glide_kinematics.errors import (
    KinematicsError,
    NotANumberError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)
from tri_glide_kinematics.tri_glide import (
    DEFAULT_GEOMETRY,
    ArmsNeverMeetError,
    ArmTooShortError,
    CoincidentAnchorsError,
    CollinearAnchorsError,
    GeometryError,
    NoPoseError,
    PlatformAboveSliderError,
    SpheresDoNotMeetError,
    TriGlide,
    TriGlideGeometry,
    UnreachableError,
    WrongAssemblyModeError,
)
from tri_glide_kinematics.tri_glide.batch import BLOCK

EPS = np.finfo(float).eps

few_examples = settings(reproducible, max_examples=many(60))

# Long arm at the middle of three anchors that are nearly in line: beyond the side of the other
# two lie poses of the other assembly mode.
TWO_MODES = TriGlideGeometry([(0.0, 0.05), (-0.3, 0.0), (0.3, 0.0)], [0.5, 0.4, 0.4])


def relative_error(found, wanted):
    """Largest error of vectors against their own length."""
    difference = np.linalg.norm(np.subtract(found, wanted), axis=-1)
    return float((difference / np.linalg.norm(wanted, axis=-1)).max())


@few_examples
@given(geometries, st.integers(0, 2**32 - 1))
def test_roundtrip_is_as_good_as_the_condition_number_allows(geometry, seed):
    machine = TriGlide(geometry)
    positions = random_positions(machine, np.random.default_rng(seed), 20)
    condition = machine.condition_number_batch(positions)
    assume(np.isfinite(condition).all())
    size = max(geometry.arm_lengths) + np.abs(positions[:, 2])
    back = machine.forward_batch(machine.inverse_batch(positions))
    # Next to a singular pose forward may find none; elsewhere it must.
    assert np.isfinite(back[condition < 1e6]).all()
    error = np.linalg.norm(back - positions, axis=1) / (size * condition)
    assert np.nanmax(error, initial=0.0) < 64.0 * EPS


@few_examples
@given(geometries, st.integers(0, 2**32 - 1))
def test_poses_are_where_the_arms_have_their_lengths(geometry, seed):
    machine = TriGlide(geometry)
    positions = random_positions(machine, np.random.default_rng(seed), 10, max_condition=100.0)
    anchors, lengths = np.array(geometry.anchors), np.array(geometry.arm_lengths)
    heights = np.array([machine.inverse(position) for position in positions.tolist()])
    places = np.array([machine.forward(row) for row in heights.tolist()])
    for place in (positions, places):
        carriages = np.dstack((np.broadcast_to(anchors, (10, 3, 2)), heights))
        arms = carriages - place[:, None]
        assert (arms[:, :, 2] > 0.0).all()
        # Below the plane of the carriages: the side on which the towers' order is kept.
        assert (np.linalg.det(arms) * geometry.doubled_area > 0.0).all()
        scale = lengths.max() + np.abs(place[:, 2]).max()
        np.testing.assert_allclose(
            np.linalg.norm(arms, axis=2), np.tile(lengths, (10, 1)), atol=1e-12 * scale
        )


def test_velocities_agree_with_central_differences():
    rng = np.random.default_rng(11)
    step = 1e-6
    for symmetric in (True, False):
        for _ in range(10):
            machine = TriGlide(random_geometry(rng, symmetric))
            positions = random_positions(machine, rng, 100, max_condition=10.0)
            velocities = rng.normal(size=positions.shape)
            difference = machine.inverse_batch(positions + step * velocities)
            difference -= machine.inverse_batch(positions - step * velocities)
            pairs = zip(positions.tolist(), velocities.tolist())
            solved = [machine.inverse_velocity(p, v) for p, v in pairs]
            heights, rates = (np.array(column) for column in zip(*solved))
            np.testing.assert_allclose(rates, difference / (2.0 * step), rtol=1e-6, atol=1e-7)

            difference = machine.forward_batch(heights + step * rates)
            difference -= machine.forward_batch(heights - step * rates)
            pairs = zip(heights.tolist(), rates.tolist())
            found = np.array([machine.forward_velocity(h, r)[1] for h, r in pairs])
            np.testing.assert_allclose(found, difference / (2.0 * step), rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("symmetric", [True, False], ids=["symmetric", "unequal"])
def test_forward_motion_is_how_the_platform_moves_with_the_sliders(symmetric):
    rng = np.random.default_rng(7)
    step = 1e-4
    for _ in range(5):
        machine = TriGlide(random_geometry(rng, symmetric))
        heights = machine.inverse_batch(random_positions(machine, rng, 200, max_condition=5.0))
        rates, accelerations = rng.normal(scale=0.1, size=(2, *heights.shape))
        rows = zip(*(values.tolist() for values in (heights, rates, accelerations)))
        found = np.array([machine.forward_motion(*row) for row in rows])
        pairs = zip(heights.tolist(), rates.tolist())
        known = np.array([np.ravel(machine.forward_velocity(*pair)) for pair in pairs])
        np.testing.assert_allclose(found[:, :6], known, rtol=0.0, atol=1e-12)
        before, now, later = (
            machine.forward_batch(heights + time * rates + 0.5 * time**2 * accelerations)
            for time in (-step, 0.0, step)
        )
        curvature = (before - 2.0 * now + later) / step**2
        np.testing.assert_allclose(found[:, 6:], curvature, rtol=0.0, atol=1e-5)


def test_jacobian_turns_platform_velocity_into_height_rates():
    rng = np.random.default_rng(12)
    machine = TriGlide(random_geometry(rng, symmetric=False))
    for position in random_positions(machine, rng, 200, max_condition=20.0).tolist():
        jacobian = np.array(machine.jacobian(position))
        columns = [machine.inverse_velocity(position, unit)[1] for unit in np.eye(3).tolist()]
        np.testing.assert_allclose(jacobian, np.transpose(columns), rtol=1e-13, atol=1e-15)
        velocity = rng.normal(size=3).tolist()
        heights, rates = machine.inverse_velocity(position, velocity)
        assert heights == machine.inverse(position)
        again, velocity_again = machine.forward_velocity(heights, rates)
        assert again == machine.forward(heights)
        assert relative_error([again, velocity_again], [position, velocity]) < 1e-12
        expected = np.linalg.svd(jacobian, compute_uv=False)[[0, 2]]
        np.testing.assert_allclose(machine.singular_values(position), expected, rtol=1e-12)


def test_condition_number_does_not_depend_on_the_height():
    machine = TriGlide(DEFAULT_GEOMETRY)
    places = [(0.05, -0.02, z) for z in (0.0, -0.3, 1e6, 1e300)]
    expected = machine.condition_number(places[0])
    np.testing.assert_allclose(machine.condition_number_batch(places), expected, rtol=1e-14)
    assert np.isnan(machine.condition_number_batch([(0.0, 0.0, math.inf)])).all()


def test_is_a_value():
    again = TriGlide(TriGlideGeometry(DEFAULT_GEOMETRY.anchors, (0.4,) * 3), compiled=True)
    assert again == TriGlide(DEFAULT_GEOMETRY)
    assert hash(again) == hash(TriGlide(DEFAULT_GEOMETRY))
    assert again != TriGlide(TriGlideGeometry(DEFAULT_GEOMETRY.anchors, (0.4, 0.4, 0.41)))
    assert again != DEFAULT_GEOMETRY


def test_condition_number_agrees_with_singular_value_decomposition():
    rng = np.random.default_rng(13)
    for symmetric in (True, False):
        machine = TriGlide(random_geometry(rng, symmetric))
        positions = random_positions(machine, rng, 2000)
        found = machine.condition_number_batch(positions)
        assert found.min() >= 1.0
        assert found.max() > 50.0
        some = positions[::5].tolist()
        expected = [np.linalg.cond(machine.jacobian(p)) for p in some]
        np.testing.assert_allclose(found[::5], expected, rtol=1e-9)
        single = [machine.condition_number(p) for p in some]
        np.testing.assert_allclose(single, found[::5], rtol=1e-9)


@few_examples
@given(geometries, st.integers(0, 2**32 - 1))
def test_batch_is_the_single_pose_repeated(geometry, seed):
    """To the last bit, in rows without a solution too."""
    machine = TriGlide(geometry)
    rng = np.random.default_rng(seed)
    size = max(geometry.arm_lengths)
    for single, batch in (
        (machine.inverse, machine.inverse_batch),
        (machine.forward, machine.forward_batch),
    ):
        rows = rng.uniform(-size, size, (20, 3))
        rows[[3, 7, 11], [0, 1, 2]] = math.nan, math.inf, -math.inf
        found = batch(rows)
        assert found.shape == (20, 3)
        for row, values in zip(rows.tolist(), found):
            try:
                expected = single(row)
            except KinematicsError:
                expected = (math.nan,) * 3
            np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("geometry", [DEFAULT_GEOMETRY, TWO_MODES], ids=["one mode", "two modes"])
def test_batch_across_blocks(geometry):
    machine = TriGlide(geometry)
    rng = np.random.default_rng(3)
    positions = random_positions(machine, rng, 40_000)
    positions[34_567] = 10.0
    heights = machine.inverse_batch(positions)
    assert np.flatnonzero(np.isnan(heights).any(axis=1)).tolist() == [34_567]
    across = slice(BLOCK - 5, BLOCK + 5)
    np.testing.assert_array_equal(heights[across], machine.inverse_batch(positions[across]))
    heights[777] = 0.0, 0.0, 10.0
    back = machine.forward_batch(heights)
    assert {777, 34_567} <= set(np.flatnonzero(np.isnan(back).any(axis=1)).tolist())
    same = machine.forward_batch(np.asfortranarray(heights[across]))
    np.testing.assert_array_equal(back[across], same)


def test_any_three_numbers_are_a_position():
    machine = TriGlide(DEFAULT_GEOMETRY)
    expected = machine.inverse((0.0, 0.0, 0.0))
    for position in ([0, 0, 0], np.zeros(3), np.zeros(3, dtype=np.float32), iter((0, 0, 0))):
        assert machine.inverse(position) == expected


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.uint8, np.int64, int])
def test_numbers_of_any_type_are_calculated_in_double_precision(kind):
    machine = TriGlide(TriGlideGeometry([(0.0, 90.0), (-80.0, -40.0), (70.0, -60.0)], (200.0,) * 3))
    place, heights, speed = ([kind(n) for n in row] for row in ((9, 8, 7), (90, 50, 40), (1, 2, 3)))
    floats, heights_too, speed_too = ([float(n) for n in row] for row in (place, heights, speed))
    assert machine.inverse(place) == machine.inverse(floats)
    assert machine.forward(heights) == machine.forward(heights_too)
    assert machine.jacobian(place) == machine.jacobian(floats)
    assert machine.condition_number(place) == machine.condition_number(floats)
    assert machine.inverse_velocity(place, speed) == machine.inverse_velocity(floats, speed_too)
    assert machine.forward_velocity(heights, speed) == machine.forward_velocity(
        heights_too, speed_too
    )
    assert {type(n) for n in (*machine.inverse(place), *machine.forward(heights))} == {float}


@pytest.mark.parametrize("thin", [1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5])
def test_velocity_is_that_of_the_jacobian_with_anchors_nearly_on_a_line(thin):
    rng = np.random.default_rng(7)
    tried = 0
    while tried < 50:
        turn = rng.uniform(0.0, 2.0 * math.pi)
        along = np.array((math.cos(turn), math.sin(turn)))
        across = np.array((-along[1], along[0]))
        anchors = np.outer(rng.uniform(-0.3, 0.3, 3), along)
        anchors += thin * np.outer(rng.uniform(-0.3, 0.3, 3), across)
        try:
            machine = TriGlide(TriGlideGeometry(anchors, rng.uniform(0.4, 0.6, 3)))
            heights = machine.inverse(rng.uniform(-0.4, 0.4, 3))
            position = machine.forward(heights)
            if machine.condition_number(position) > 30.0:
                continue
        except KinematicsError:
            continue
        tried += 1
        rates = rng.normal(size=3)
        velocity = machine.forward_velocity(heights, rates)[1]
        wanted = np.linalg.solve(machine.jacobian(position), rates)
        # What is left comes from the position, whose digits the thin triangle costs.
        assert relative_error(velocity, wanted) < 1e-12 / thin


def test_the_text_of_a_machine_makes_it_again():
    for geometry in (DEFAULT_GEOMETRY, TWO_MODES):
        machine = TriGlide(geometry)
        assert eval(repr(machine)) == machine


class TestErrorsOfPoses:
    machine = TriGlide(DEFAULT_GEOMETRY)
    calls = (
        ("position", machine.inverse),
        ("position", lambda p: TestErrorsOfPoses.machine.inverse_velocity(p, (0.0, 0.0, 0.0))),
        ("velocity", lambda v: TestErrorsOfPoses.machine.inverse_velocity((0.0, 0.0, 0.0), v)),
        ("heights", machine.forward),
        ("heights", lambda h: TestErrorsOfPoses.machine.forward_velocity(h, (0.0, 0.0, 0.0))),
        ("height_rates", lambda r: TestErrorsOfPoses.machine.forward_velocity((0.6,) * 3, r)),
        ("position", machine.jacobian),
        ("position", machine.singular_values),
        ("position", machine.condition_number),
    )

    @pytest.mark.parametrize(("name", "call"), calls)
    @pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
    @pytest.mark.parametrize("index", [0, 1, 2])
    def test_not_finite(self, name, call, value, index):
        numbers = [0.0, 0.0, 0.0]
        numbers[index] = value
        with pytest.raises(NotFiniteError, match=rf"{name}\[{index}\] = {value}"):
            call(numbers)

    @pytest.mark.parametrize(("name", "call"), calls)
    def test_no_numbers(self, name, call):
        for values in ("abc", ("a", "b", "c")):
            with pytest.raises(NotANumberError, match=rf"{name}\[0\] = 'a' is not a number"):
                call(values)
        for values in (0.3, None):
            with pytest.raises(WrongShapeError, match=rf"{name} has shape \(\), expected \(3,\)"):
                call(values)
        with pytest.raises(NotANumberError, match=rf"{name}\[1\] = None is not a number"):
            call((0.0, None, 0.0))

    @pytest.mark.parametrize(("name", "call"), calls)
    @pytest.mark.parametrize("values", [(), (0.0, 0.0), (0.0,) * 4])
    def test_wrong_number_of_numbers(self, name, call, values):
        with pytest.raises(WrongShapeError, match=f"{name} has shape") as caught:
            call(values)
        assert caught.value.shape == (len(values),)

    @pytest.mark.parametrize("shape", [(3,), (2, 2), (1, 3, 1)])
    def test_wrong_shape_of_a_batch(self, shape):
        machine = self.machine
        for call in (machine.inverse_batch, machine.forward_batch, machine.condition_number_batch):
            with pytest.raises(WrongShapeError, match=r"expected \(n, 3\)"):
                call(np.zeros(shape))

    def test_the_arm_that_is_named_is_not_left_to_rounding(self):
        rng = np.random.default_rng(8)
        named = set()
        for _ in range(100):
            with pytest.raises(ArmTooShortError) as far:
                self.machine.inverse(nudged(rng, (0.0, 0.5, 0.1)))
            with pytest.raises(PlatformAboveSliderError) as high:
                self.machine.forward(nudged(rng, (0.75, 0.3, 0.3)))
            named.add((far.value.arm, high.value.arm))
        assert len(named) == 1

    @pytest.mark.parametrize("compiled", [False, True])
    @pytest.mark.parametrize("nothing", [[], (), np.empty((0, 3))])
    def test_nothing_gives_nothing(self, nothing, compiled):
        machine = TriGlide(DEFAULT_GEOMETRY, compiled=compiled)
        assert machine.inverse_batch(nothing).shape == (0, 3)
        assert machine.forward_batch(nothing).shape == (0, 3)
        assert machine.condition_number_batch(nothing).shape == (0,)

    def test_what_overflows_is_refused(self):
        with pytest.raises(ArmTooShortError):
            self.machine.inverse((1e200, 0.0, 0.0))
        for heights in ((0.0, 0.0, 1e200), (1e200, 0.0, 0.0)):
            with pytest.raises(SpheresDoNotMeetError, match="discriminant -inf"):
                self.machine.forward(heights)
        with pytest.raises(NotFiniteError, match="height_rates"):
            self.machine.inverse_velocity((0.0, 0.0, 0.0), (0.0, 1.7e308, 1.7e308))
        with pytest.raises(NotFiniteError, match="velocity"):
            self.machine.forward_velocity((0.6, 0.6, 0.6), (-1e308, 1e308, 1e308))

    def test_arm_too_short(self):
        position = (0.3, -0.2, 0.1)
        with pytest.raises(UnreachableError) as caught:
            self.machine.inverse(position)
        error = caught.value
        assert isinstance(error, ArmTooShortError)
        assert (error.position, error.arm, error.arm_length) == (position, 0, 0.4)
        assert error.distance == pytest.approx(0.5)
        assert str(error) == (
            "position (0.3, -0.2, 0.1) m is out of reach of arm 1: horizontal distance 0.5 m, "
            "arm length 0.4 m"
        )

    def test_level_arm_is_refused(self):
        """There the velocity of the slider has no bound."""
        machine = TriGlide(TriGlideGeometry([(0.0, 0.0), (2.0, 1.0), (2.0, -1.0)], [1.0, 4.0, 4.0]))
        machine.inverse((math.nextafter(1.0, 0.0), 0.0, 0.0))
        with pytest.raises(ArmTooShortError, match="horizontal distance 1 m, arm length 1 m"):
            machine.inverse((1.0, 0.0, 0.0))
        assert np.isnan(machine.inverse_batch([(1.0, 0.0, 0.0)])).all()

    def test_spheres_do_not_meet(self):
        with pytest.raises(NoPoseError, match="the arms do not meet") as caught:
            self.machine.forward((0.1, 0.2, 2.0))
        assert isinstance(caught.value, SpheresDoNotMeetError)
        assert caught.value.heights == (0.1, 0.2, 2.0)
        assert caught.value.discriminant < 0.0

    @pytest.mark.parametrize("heights", [(0.2, 0.6, 0.6), (0.6, 0.2, 0.6), (0.6, 0.6, math.nan)])
    def test_forward_motion_refuses_what_forward_does(self, heights):
        with pytest.raises(KinematicsError) as expected:
            self.machine.forward(heights)
        with pytest.raises(type(expected.value)) as caught:
            self.machine.forward_motion(heights, (0.0,) * 3, (0.0,) * 3)
        assert str(caught.value) == str(expected.value)

    def test_platform_above_a_slider(self):
        heights = (0.6, 0.6, 0.1)
        with pytest.raises(NoPoseError, match="put the platform above slider 3") as caught:
            self.machine.forward(heights)
        assert isinstance(caught.value, PlatformAboveSliderError)
        assert (caught.value.heights, caught.value.arm) == (heights, 2)
        assert -0.4 < caught.value.rise < 0.0

    def test_other_assembly_mode(self):
        machine = TriGlide(TWO_MODES)
        position = (0.0, -0.2, 0.0)
        with pytest.raises(UnreachableError, match="belongs to the other assembly mode") as caught:
            machine.inverse(position)
        assert isinstance(caught.value, WrongAssemblyModeError)
        assert caught.value.position == position
        assert caught.value.plane_height < 0.0
        with pytest.raises(WrongAssemblyModeError):
            machine.inverse_velocity(position, (0.0, 0.0, 0.0))
        assert np.isnan(machine.inverse_batch([position])).all()
        # The arms do reach this place, but from those heights forward finds another one.
        anchors, lengths = np.array(TWO_MODES.anchors), np.array(TWO_MODES.arm_lengths)
        rises = np.sqrt(lengths**2 - ((anchors - position[:2]) ** 2).sum(axis=1))
        try:
            found = machine.forward(rises.tolist())
        except NoPoseError:
            found = (math.inf,) * 3
        assert math.dist(found, position) > 0.01


class TestGeometry:
    def test_symmetric_is_the_table_of_the_source(self):
        base, platform, beta = 0.31, 0.07, 0.4
        geometry = TriGlideGeometry.symmetric(base, platform, 0.5, beta)
        towers = [math.pi / 2.0 + beta + k * 2.0 * math.pi / 3.0 for k in range(3)]
        expected = [
            ((base - platform) * math.cos(a), (base - platform) * math.sin(a)) for a in towers
        ]
        np.testing.assert_allclose(geometry.anchors, expected, atol=1e-15)
        assert geometry.arm_lengths == (0.5, 0.5, 0.5)
        assert geometry.doubled_area > 0.0

    def test_is_a_value(self):
        again = TriGlideGeometry(np.array(DEFAULT_GEOMETRY.anchors), [0.4, 0.4, 0.4])
        assert again == DEFAULT_GEOMETRY
        assert hash(again) == hash(DEFAULT_GEOMETRY)
        with pytest.raises(AttributeError):
            again.arm_lengths = (1.0, 1.0, 1.0)

    @pytest.mark.parametrize(
        ("anchors", "lengths", "error", "text"),
        [
            ([(0, 0), (1, 0)], [1, 1, 1], WrongShapeError, r"anchors has shape \(2, 2\)"),
            ([(0, 0), (1, 0), (0, 1)], [1, 1], WrongShapeError, "arm_lengths has shape"),
            ([(0, math.nan), (1, 0), (0, 1)], [1] * 3, NotFiniteError, r"anchors\[0\]\[1\] = nan"),
            ([(0, 0), (1, 0), (0, 1)], [1, math.inf, 1], NotFiniteError, r"arm_lengths\[1\] = inf"),
            ([(0, 0), (1, 0), (0, 1)], [1, 1, 0], OutOfBoundsError, r"arm_lengths\[2\] = 0 m"),
            ([(0, 0), (1, 0), (0, 1)], [-1, 1, 1], OutOfBoundsError, r"arm_lengths\[0\] = -1 m"),
            ([(0, 0), (1, 0), (1, 0)], [1] * 3, CoincidentAnchorsError, "arms 2 and 3 coincide"),
            ([(1, 1), (1, 0), (1, 1)], [1] * 3, CoincidentAnchorsError, "arms 1 and 3 coincide"),
            ([(0, 0), (1, 1), (3, 3)], [4] * 3, CollinearAnchorsError, "lie on one line"),
            ([(0, 0), (2, 0), (0, 2)], [0.9, 1, 5], ArmsNeverMeetError, "arms of 0.9, 1, 5 m"),
            ([(0, 0), (4, 0), (2, 4)], [2.2, 2.2, 2.2], ArmsNeverMeetError, "never meet"),
        ],
    )
    def test_degenerate(self, anchors, lengths, error, text):
        with pytest.raises(error, match=text):
            TriGlideGeometry(anchors, lengths)

    def test_degenerate_errors_carry_their_data(self):
        with pytest.raises(GeometryError) as caught:
            TriGlideGeometry([(0, 0), (1, 0), (1, 0)], [1, 1, 1])
        assert (caught.value.arms, caught.value.place, caught.value.distance) == ((1, 2), (1, 0), 0)
        with pytest.raises(GeometryError) as caught:
            TriGlideGeometry([(0, 0), (1, 1), (3, 3)], [4, 4, 4])
        assert caught.value.anchors == ((0, 0), (1, 1), (3, 3))
        assert caught.value.height == 0.0
        with pytest.raises(GeometryError) as caught:
            TriGlideGeometry([(0, 0), (4, 0), (2, 4)], [2.2, 2.2, 2.2])
        assert caught.value.arm_lengths == (2.2, 2.2, 2.2)

    @pytest.mark.parametrize(
        ("numbers", "error"),
        [
            ((0.2, 0.2, 0.4), CoincidentAnchorsError),
            ((0.25, 0.05, 0.2), ArmsNeverMeetError),
            ((-0.25, 0.05, 0.4), OutOfBoundsError),
            ((0.25, -0.05, 0.4), OutOfBoundsError),
            ((0.25, 0.05, 0.0), OutOfBoundsError),
            ((math.nan, 0.05, 0.4), NotFiniteError),
            ((0.25, 0.05, 0.4, math.inf), NotFiniteError),
        ],
    )
    def test_degenerate_symmetric(self, numbers, error):
        with pytest.raises(error):
            TriGlideGeometry.symmetric(*numbers)

    def test_arms_meet_exactly_if_some_place_is_in_reach_of_all(self):
        """Against a search over the triangle, which holds the best place of all."""
        rng = np.random.default_rng(5)
        weights = rng.dirichlet((0.5, 0.5, 0.5), 20_000)
        counts = {True: 0, False: 0}
        for _ in range(many(100)):
            anchors, lengths = rng.uniform(-1.0, 1.0, (3, 2)), rng.uniform(0.2, 1.3, 3)
            distances = np.linalg.norm((weights @ anchors)[:, None] - anchors, axis=2)
            slack = (lengths - distances).min(axis=1).max()
            if abs(slack) < 0.02:
                continue
            try:
                TriGlideGeometry(anchors, lengths)
                meets = True
            except ArmsNeverMeetError:
                meets = False
            assert meets == (slack > 0.0)
            counts[meets] += 1
        assert min(counts.values()) > many(15)

    def test_single_assembly_mode_is_proven_only_where_it_holds(self):
        rng = np.random.default_rng(6)
        proven = refuted = 0
        for _ in range(many(100)):
            anchors = rng.uniform(-1.0, 1.0, (3, 2))
            lengths = rng.uniform(1.0, 2.0) * (1.0 + rng.uniform(0.0, 0.1) * rng.uniform(-1, 1, 3))
            try:
                geometry = TriGlideGeometry(anchors, lengths)
            except GeometryError:
                continue
            reach = geometry.arm_lengths
            places = rng.uniform(-3.0, 3.0, (20_000, 2))
            across = np.array(geometry.anchors) - places[:, None]
            squared = np.square(reach) - (across**2).sum(axis=2)
            inside = (squared > 0.0).all(axis=1)
            arms = np.dstack((across, np.sqrt(np.abs(squared))))[inside]
            below = np.linalg.det(arms) * geometry.doubled_area > 0.0
            if geometry.has_single_assembly_mode():
                proven += 1
                assert below.all()
            else:
                refuted += not below.all()
        assert min(proven, refuted) >= many(6)

    def test_a_right_angle_is_one_however_the_machine_stands(self):
        right_angle = np.array([0.2, 0.2j, 0.0]) + (0.3 + 0.1j)
        for angle in np.random.default_rng(7).uniform(-math.pi, math.pi, 300):
            turned = right_angle * np.exp(1j * angle)
            geometry = TriGlideGeometry(np.column_stack((turned.real, turned.imag)), (0.5,) * 3)
            assert not geometry.has_single_assembly_mode()

    def test_calibrated_machine_needs_no_check_of_the_assembly_mode(self):
        assert DEFAULT_GEOMETRY.has_single_assembly_mode()
        anchors = np.array(DEFAULT_GEOMETRY.anchors) + 0.002 * np.array([(1, -1), (0, 1), (-1, 0)])
        assert TriGlideGeometry(anchors, (0.399, 0.4, 0.401)).has_single_assembly_mode()
        assert not TWO_MODES.has_single_assembly_mode()


def printed_tables(r, R, L, beta, heights, rates, erratum):  # noqa: N803
    """Forward position and velocity as source 000, section 3.2, prints them.

    With ``erratum`` the velocity of A_z has its bracket as printed, otherwise where it belongs.
    """
    sin, cos = math.sin, math.cos
    thirty = math.radians(30.0)
    p1x, p1y = (R - r) * sin(beta), (r - R) * cos(beta)
    p2x, p2y = (R - r) * cos(thirty + beta), (R - r) * sin(thirty + beta)
    p3x, p3y = (r - R) * cos(thirty - beta), (R - r) * sin(thirty - beta)
    h1, h2, h3 = heights
    k1, k2, k3 = rates
    c1, c2, c3 = p1x**2 + p1y**2, p2x**2 + p2y**2, p3x**2 + p3y**2
    c4, c5, c6 = p2x - p1x, p2y - p1y, c1 - c2
    c7, c8, c9 = p3x - p1x, p3y - p1y, c1 - c3
    c10, c11 = c4 * c8 - c5 * c7, c1 - L**2
    d1, d2, d3 = h1**2, h2**2, h3**2
    d4, d5, d6, d7 = h2 - h1, d1 - d2, h3 - h1, d1 - d3
    d8 = (c7 * d4 - c4 * d6) / c10
    d9 = (c7 * (c6 + d5) - c4 * (c9 + d7)) / (2 * c10)
    d10 = (c5 * d6 - c8 * d4) / c10
    d11 = (c5 * (c9 + d7) - c8 * (c6 + d5)) / (2 * c10)
    d12 = d8**2 + d10**2 + 1
    d13 = 2 * (d8 * (d9 - p1y) + d10 * (d11 - p1x) - h1)
    d14 = d9**2 + d11**2 - 2 * (p1x * d11 + p1y * d9) + d1 + c11
    d15 = math.sqrt(d13**2 - 4 * d12 * d14)
    az = -(d13 + d15) / (2 * d12)
    e1, e2, e3 = 2 * h1 * k1, 2 * h2 * k2, 2 * h3 * k3
    e4, e5, e6, e7 = k2 - k1, e1 - e2, k3 - k1, e1 - e3
    e8, e9 = (c7 * e4 - c4 * e6) / c10, (c7 * e5 - c4 * e7) / (2 * c10)
    e10, e11 = (c5 * e6 - c8 * e4) / c10, (c5 * e7 - c8 * e5) / (2 * c10)
    e12 = 2 * (d8 * e8 + d10 * e10)
    e13 = 2 * (d8 * e9 + e8 * (d9 - p1y) + d10 * e11 + e10 * (d11 - p1x) - k1)
    e14 = 2 * (e9 * (d9 - p1y) + e11 * (d11 - p1x)) + e1
    inner = e13 + (d13 * e13 - 2 * (d12 * e14 + e12 * d14)) / d15
    if erratum:
        vz = -d12 * (inner - e12 * (d13 + d15)) / (2 * d12**2)
    else:
        vz = -(d12 * inner - e12 * (d13 + d15)) / (2 * d12**2)
    position = (d10 * az + d11, d8 * az + d9, az)
    return position, (d10 * vz + e10 * az + e11, d8 * vz + e8 * az + e9, vz)


class TestSource:
    """The solution tables of source 000, calculated as they are printed."""

    r, R, L = 0.25, 0.05, 0.4
    poses = (
        (0.0, (0.62, 0.55, 0.58), (0.3, -0.2, 0.5)),
        # Here two anchors have the same x, which intermediate lines of the source divide by.
        (math.radians(30.0), (0.55, 0.6, 0.65), (-0.4, 0.1, 0.3)),
        (1.1, (-0.1, 0.05, 0.1), (0.7, 0.6, -0.5)),
    )

    @pytest.mark.parametrize(("beta", "heights", "rates"), poses)
    def test_forward_table(self, beta, heights, rates):
        machine = TriGlide(TriGlideGeometry.symmetric(self.r, self.R, self.L, beta))
        position, velocity = machine.forward_velocity(heights, rates)
        printed = printed_tables(self.r, self.R, self.L, beta, heights, rates, erratum=False)
        np.testing.assert_allclose(position, printed[0], atol=1e-13)
        np.testing.assert_allclose(velocity, printed[1], atol=1e-12)

    @pytest.mark.parametrize(("beta", "heights", "rates"), poses)
    def test_printed_bracket_of_the_velocity_is_wrong(self, beta, heights, rates):
        machine = TriGlide(TriGlideGeometry.symmetric(self.r, self.R, self.L, beta))
        step = 1e-6
        ahead, behind = (
            machine.forward([h + sign * step * k for h, k in zip(heights, rates)])
            for sign in (1.0, -1.0)
        )
        difference = np.subtract(ahead, behind) / (2.0 * step)
        np.testing.assert_allclose(
            machine.forward_velocity(heights, rates)[1], difference, atol=1e-8
        )
        printed = printed_tables(self.r, self.R, self.L, beta, heights, rates, erratum=True)
        assert abs(printed[1][2] - difference[2]) > 1e-3
