import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from soak import many
from strategies import DEFAULT_LIMITS, accepts, is_inside, nudged, random_geometry, random_positions

from tri_glide_kinematics.errors import (
    KinematicsError,
    NotANumberError,
    NotFiniteError,
    OutOfBoundsError,
    WrongShapeError,
)
from tri_glide_kinematics.tri_glide import (
    DEFAULT_GEOMETRY,
    NoPoseError,
    TriGlide,
    TriGlideGeometry,
    UnreachableError,
    WrongAssemblyModeError,
)
from tri_glide_kinematics.workspace import (
    ROUNDING,
    TOLERANCE,
    ConditionField,
    Cylinder,
    OutsideWorkspaceError,
    SliderMotionState,
    Workspace,
    WorkspaceLimit,
    WorkspaceLimits,
)

MACHINE = TriGlide(DEFAULT_GEOMETRY)
CYLINDER = Cylinder(0.01, -0.02, 0.11, 0.1, 0.45)
WORKSPACES = {
    "plain": Workspace(MACHINE, DEFAULT_LIMITS),
    "conditioning": Workspace(MACHINE, replace(DEFAULT_LIMITS, max_condition_number=3.0)),
    "box": Workspace(
        MACHINE, replace(DEFAULT_LIMITS, box_lower=(-0.1, -0.12, 0.05), box_upper=(0.11, 0.1, 0.4))
    ),
    "cylinder": Workspace(MACHINE, replace(DEFAULT_LIMITS, cylinder=CYLINDER)),
    "unequal": Workspace(
        TriGlide(TriGlideGeometry([(0.02, 0.2), (-0.2, -0.08), (0.15, -0.1)], (0.4, 0.45, 0.36))),
        WorkspaceLimits((0.3, 0.25, 0.3), (0.9, 0.8, 0.9), 0.0, 6.0),
    ),
}
WORKSPACES["turned"] = Workspace(
    TriGlide(TriGlideGeometry([(0.15, -0.1), (-0.2, -0.08), (0.02, 0.2)], (0.36, 0.45, 0.4))),
    WorkspaceLimits((0.3, 0.25, 0.3), (0.9, 0.8, 0.9), 0.0, 6.0),
)
every_workspace = pytest.mark.parametrize("workspace", WORKSPACES.values(), ids=WORKSPACES)


def depths_outside(workspace, positions):
    """By how much each limit is broken at places, none if negative. Shape (n, limits).

    Worked out from the definitions: metres for all limits but the last, which is the condition
    number's ratio to its bound, minus 1.
    """
    limits, machine = workspace.limits, workspace.machine
    positions = np.asarray(positions)
    heights = machine.inverse_batch(positions)
    anchors, lengths = np.array(machine.geometry.anchors), np.array(machine.geometry.arm_lengths)
    distances = np.linalg.norm(positions[:, None, :2] - anchors, axis=2)
    columns = [
        distances - (lengths - limits.reach_margin),
        limits.lower_heights - heights,
        heights - limits.upper_heights,
    ]
    if limits.box_lower:
        columns.append(limits.box_lower - positions)
        columns.append(positions - limits.box_upper)
    if limits.cylinder:
        x, y, z = positions.T
        c = limits.cylinder
        columns.append(np.hypot(x - c.center_x, y - c.center_y)[:, None] - c.radius)
        columns.append(np.column_stack((c.z_min - z, z - c.z_max)))
    columns.append(
        machine.condition_number_batch(positions)[:, None] / limits.max_condition_number - 1.0
    )
    depths = np.concatenate(columns, axis=1)
    depths[np.isnan(heights).any(axis=1)] = math.inf
    return depths


def inside_positions(workspace, rng, count):
    found = []
    while len(found) < count:
        positions = random_positions(workspace.machine, rng, count).tolist()
        found += [position for position in positions if is_inside(workspace, position)]
    return found[:count]


@every_workspace
def test_places_against_the_definition(workspace):
    rng = np.random.default_rng(1)
    lower, upper = (-0.3, -0.3, -0.3), (0.3, 0.3, 0.9)
    positions = rng.uniform(lower, upper, (many(1500), 3))
    depth = depths_outside(workspace, positions).max(axis=1)
    decided = np.abs(depth) > 10.0 * ROUNDING
    found = [is_inside(workspace, p) for p in positions.tolist()]
    assert 10 < sum(found) < 0.5 * len(found)
    np.testing.assert_array_equal(np.array(found)[decided], (depth <= 0.0)[decided])
    for position in positions[np.array(found)].tolist():
        heights = workspace.check_position(position)
        assert heights == workspace.machine.inverse(position)
        np.testing.assert_allclose(workspace.check_heights(heights), position, atol=1e-12)
    for heights in rng.uniform(0.2, 1.0, (many(300), 3)).tolist():
        try:
            position = workspace.machine.forward(heights)
        except NoPoseError:
            assert not accepts(workspace.check_heights, heights)
            continue
        depth = depths_outside(workspace, [position]).max()
        assert accepts(workspace.check_heights, heights) == (depth <= 0.0)


@every_workspace
def test_segments_against_dense_samples(workspace):
    rng = np.random.default_rng(2)
    fractions = np.linspace(0.0, 1.0, 501)[:, None]
    counts = {True: 0, False: 0}
    for start in inside_positions(workspace, rng, many(60)):
        end = (start + rng.normal(0.0, 0.1, 3)).tolist()
        line = start + fractions * np.subtract(end, start)
        length = math.dist(start, end)
        depths = depths_outside(workspace, line)
        inside = (depths <= ROUNDING).all(axis=1)
        try:
            workspace.check_segment(start, end)
        except KinematicsError as error:
            counts[False] += 1
            # Not refused without reason: the place named is at the edge of the inside, and the
            # line does not leave before.
            way = math.dist(start, error.position)
            before = fractions[:, 0] * length < way - 2.0 * TOLERANCE
            assert inside[before].all()
            at = depths_outside(workspace, [error.position]).max()
            assert at > -1e-8
            assert isinstance(error, OutsideWorkspaceError)
            assert error.limit.value in str(error)
        else:
            counts[True] += 1
            assert inside.all()
    assert min(counts.values()) > 5


@pytest.mark.parametrize("across", [0.2, 0.01, 1e-3, 1e-4])
def test_exit_distance_of_steep_lines_at_the_condition_number(across):
    workspace = Workspace(
        MACHINE,
        replace(
            DEFAULT_LIMITS,
            lower_heights=(-99.0,) * 3,
            upper_heights=(99.0,) * 3,
            max_condition_number=3.0,
        ),
    )
    field = ConditionField(DEFAULT_GEOMETRY, 3.0)
    rng = np.random.default_rng(4)
    for turn in rng.uniform(0.0, 2.0 * math.pi, 40):
        way = np.array((math.cos(turn), math.sin(turn)))
        # Where the level line ends is found by halving, and the place is just inside of it.
        inside, edge = 0.0, 0.4
        while edge - inside > 1e-12:
            middle = 0.5 * (inside + edge)
            inside, edge = (middle, edge) if field.around(*(middle * way)) else (inside, middle)
        start = (*((inside - 1e-3 * across) * way), 0.3)
        direction = np.array((*(across * way), 1.0))
        wanted = 1e-3 * np.linalg.norm(direction)
        found = workspace.exit_distance(start, direction, 2.0)
        assert wanted - 1.5 * TOLERANCE <= found <= wanted + 1e-8 / across


def test_no_reach_is_left_by_a_margin_as_long_as_an_arm():
    for margin in (0.4, 7):
        with pytest.raises(
            OutOfBoundsError, match=rf"reach_margin = {margin} m .* shortest arm, 0.4"
        ):
            Workspace(MACHINE, replace(DEFAULT_LIMITS, reach_margin=margin))


def test_the_text_of_a_workspace_makes_it_again():
    from tri_glide_kinematics import TriGlide, TriGlideGeometry  # noqa: F401

    for workspace in WORKSPACES.values():
        assert eval(repr(workspace)) == workspace
    away = WORKSPACES["plain"].widened_to(MACHINE.inverse((0.0, 0.0, 0.6)))
    assert repr(away).endswith(".widened_to(...)")


@every_workspace
def test_exit_distance_from_both_sides(workspace):
    rng = np.random.default_rng(3)
    for start in inside_positions(workspace, rng, many(40)):
        direction = rng.normal(size=3)
        unit = direction / np.linalg.norm(direction)
        distance = workspace.exit_distance(start, direction.tolist(), 2.0)
        assert 0.0 <= distance < 2.0
        inside = np.array(start) + unit * np.linspace(0.0, distance, 500)[:, None]
        assert (depths_outside(workspace, inside) <= 2.0 * ROUNDING).all()
        beyond = np.array(start) + unit * (distance + 2.5 * TOLERANCE)
        assert depths_outside(workspace, [beyond]).max() > -ROUNDING
        assert workspace.exit_distance(start, direction.tolist(), 0.5 * distance) == pytest.approx(
            0.5 * distance, abs=1e-15
        )


def smooth_path(start, end, sideways, duration):
    """Sliders from start to end, and sideways in between; with all that describes it."""
    start, end, sideways = (np.array(values) for values in (start, end, sideways))

    def course(times):
        phase = math.pi * np.asarray(times)[..., None] / duration
        return (
            start + (end - start) * (1.0 - np.cos(phase)) / 2.0 + sideways * np.sin(phase) ** 2,
            math.pi
            / duration
            * ((end - start) * np.sin(phase) / 2.0 + sideways * np.sin(2.0 * phase)),
        )

    def state(time):
        heights, velocities = course(time)
        return SliderMotionState(tuple(heights.tolist()), tuple(velocities.tolist()))

    peak = np.linalg.norm(end - start) / 2.0 + 2.0 * np.linalg.norm(sideways)
    return course, state, (math.pi / duration) ** 2 * peak


@every_workspace
def test_paths_against_dense_samples(workspace):
    rng = np.random.default_rng(4)
    machine = workspace.machine
    counts = {True: 0, False: 0}
    points = [machine.inverse(p) for p in inside_positions(workspace, rng, many(30))]
    for start, end in pairwise(points):
        duration = rng.uniform(0.1, 2.0)
        sideways = rng.normal(size=3) * rng.choice([0.0, 0.02, 0.1])
        course, state, acceleration = smooth_path(start, end, sideways, duration)
        times = np.linspace(0.0, duration, 1001)
        heights = course(times)[0]
        positions = machine.forward_batch(heights)
        posed = np.isfinite(positions[:, 0])
        depths = np.full((len(times), 1), math.inf)
        depths[posed] = depths_outside(workspace, positions[posed]).max(axis=1, keepdims=True)
        try:
            workspace.check_path(state, duration, acceleration)
        except KinematicsError as error:
            counts[False] += 1
            way = np.linalg.norm(positions - getattr(error, "position", (math.nan,) * 3), axis=1)
            if isinstance(error, OutsideWorkspaceError):
                place = int(np.nanargmin(way))
                assert way[place] < 2e-3
                # Nothing before it is outside by more than what a sample leaves open.
                assert depths[: max(0, place - 1)].max(initial=0.0) < 10.0 * TOLERANCE
                assert depths_outside(workspace, [error.position]).max() > -1e-8
            else:
                assert isinstance(error, NoPoseError)
                assert not posed.all()
        else:
            counts[True] += 1
            assert depths.max() < 10.0 * TOLERANCE
    assert min(counts.values()) > 1


def test_condition_field_vouches_for_its_surroundings():
    """Within the radius the condition number, the gain and the slope all hold."""
    rng = np.random.default_rng(5)
    for symmetric in (True, False):
        machine = TriGlide(random_geometry(rng, symmetric))
        limit = 8.0
        field = ConditionField(machine.geometry, limit)
        for position in random_positions(machine, rng, many(40)).tolist():
            around = field.around(*position[:2])
            assert (around is None) == (machine.condition_number(position) > limit * (1 + 1e-8))
            if around is None:
                continue
            angles = np.linspace(0.0, 2.0 * math.pi, 24)
            circle = np.column_stack((np.cos(angles), np.sin(angles), 0.0 * angles))
            nearby = position + around.radius * circle * rng.uniform(0.0, 1.0, (24, 1)) ** 0.2
            if around.radius > TOLERANCE:
                assert machine.condition_number_batch(nearby).max() <= limit * (1.0 + 1e-9)
            jacobian = np.array(machine.jacobian(position))
            for place in nearby.tolist():
                other = np.array(machine.jacobian(place))
                singular = np.linalg.svd(other, compute_uv=False)
                assert singular[2] >= around.singular_value * (1.0 - 1e-12)
                change = np.linalg.norm(other - jacobian, 2)
                assert change <= around.slope * math.dist(place, position) * (1.0 + 1e-9) + 1e-12


class TestLimitsOneByOne:
    center = (0.0, 0.0, 0.25)

    def refused(self, workspace, position, limit, arm, value, bound):
        with pytest.raises(OutsideWorkspaceError) as caught:
            workspace.check_position(position)
        error = caught.value
        assert (error.limit, error.arm, error.position) == (limit, arm, tuple(position))
        assert error.value == pytest.approx(value, rel=1e-6)
        assert error.bound == pytest.approx(bound, rel=1e-6)
        with pytest.raises(OutsideWorkspaceError) as caught:
            workspace.check_segment(self.center, position)
        assert (caught.value.limit, caught.value.arm) == (limit, arm)
        way = math.dist(self.center, caught.value.position)
        unit = np.subtract(position, self.center)
        free = workspace.exit_distance(self.center, unit.tolist(), 10.0)
        assert free == pytest.approx(way, abs=2.5 * TOLERANCE)
        return str(error)

    def test_travel(self):
        workspace = WORKSPACES["plain"]
        rise = math.sqrt(0.4**2 - 0.2**2)
        text = self.refused(
            workspace, (0.0, 0.0, -0.1), WorkspaceLimit.LOWER_TRAVEL, 0, rise - 0.1, 0.3
        )
        assert text == (
            "outside the workspace at (0, 0, -0.1) m: 0.246410162 m breaks the lower end of slider "
            "travel of arm 1, 0.3 m"
        )
        self.refused(workspace, (0.0, 0.0, 0.6), WorkspaceLimit.UPPER_TRAVEL, 0, rise + 0.6, 0.9)

    def test_reach(self):
        machine = TriGlide(TriGlideGeometry.symmetric(0.25, 0.05, 0.40, math.pi))
        workspace = Workspace(machine, replace(DEFAULT_LIMITS, max_condition_number=1000.0))
        text = self.refused(workspace, (0.0, 0.197, 0.25), WorkspaceLimit.REACH, 0, 0.397, 0.395)
        assert "0.397 m breaks the horizontal reach of arm 1, 0.395" in text

    def test_condition_number(self):
        workspace = WORKSPACES["conditioning"]
        position = (0.0, -0.15, 0.25)
        value = np.linalg.cond(MACHINE.jacobian(position))
        text = self.refused(workspace, position, WorkspaceLimit.CONDITION, None, value, 3.0)
        assert "breaks the largest condition number, 3" in text

    @pytest.mark.parametrize("axis", range(3))
    def test_box(self, axis):
        limit = (WorkspaceLimit.BOX_X, WorkspaceLimit.BOX_Y, WorkspaceLimit.BOX_Z)[axis]
        workspace = WORKSPACES["box"]
        for corner, sign in ((workspace.limits.box_lower, -1), (workspace.limits.box_upper, 1)):
            position = list(self.center)
            position[axis] = corner[axis] + sign * 0.01
            text = self.refused(workspace, position, limit, None, position[axis], corner[axis])
            assert f"breaks the box in {'xyz'[axis]}" in text

    def test_cylinder(self):
        workspace = WORKSPACES["cylinder"]
        radius = math.hypot(0.1 - 0.01, 0.1 + 0.02)
        limit = WorkspaceLimit.CYLINDER_RADIUS
        self.refused(workspace, (0.1, 0.1, 0.25), limit, None, radius, 0.11)
        self.refused(workspace, (0.0, 0.0, 0.09), WorkspaceLimit.CYLINDER_Z, None, 0.09, 0.1)
        self.refused(workspace, (0.0, 0.0, 0.46), WorkspaceLimit.CYLINDER_Z, None, 0.46, 0.45)

    def test_half_open_box(self):
        workspace = Workspace(MACHINE, replace(DEFAULT_LIMITS, box_lower=(-0.05, -0.05, 0.2)))
        workspace.check_position((0.1, 0.1, 0.5))
        with pytest.raises(OutsideWorkspaceError, match="box in z"):
            workspace.check_position((0.0, 0.0, 0.19))

    def test_no_place_at_all(self):
        workspace = WORKSPACES["plain"]
        for values, error in (
            ((math.nan, 0.0, 0.0), NotFiniteError),
            ((0.0, 0.0), WrongShapeError),
        ):
            for call in (workspace.check_position, workspace.check_heights, workspace.widened_to):
                with pytest.raises(error):
                    call(values)
            with pytest.raises(error):
                workspace.check_segment(self.center, values)
            with pytest.raises(error):
                workspace.exit_distance(self.center, values, 1.0)
        with pytest.raises(NoPoseError):
            workspace.check_heights((0.3, 0.3, 0.9))
        with pytest.raises(OutOfBoundsError, match="length of direction"):
            workspace.exit_distance(self.center, (0.0, 0.0, 0.0), 1.0)
        with pytest.raises(OutOfBoundsError, match="maximum"):
            workspace.exit_distance(self.center, (1.0, 0.0, 0.0), -1.0)

    def test_other_assembly_mode(self):
        machine = TriGlide(
            TriGlideGeometry([(0.0, 0.05), (-0.3, 0.0), (0.3, 0.0)], [0.5, 0.4, 0.4])
        )
        workspace = Workspace(machine, WorkspaceLimits((-9.0,) * 3, (9.0,) * 3, 0.001, 1000.0))
        with pytest.raises(UnreachableError) as caught:
            workspace.check_position((0.0, -0.2, 0.0))
        assert isinstance(caught.value, WrongAssemblyModeError)
        # On the way there lies the singular pose, at which the condition number has no bound.
        with pytest.raises(OutsideWorkspaceError) as caught:
            workspace.check_segment((0.0, 0.02, 0.0), (0.0, -0.2, 0.0))
        assert caught.value.limit is WorkspaceLimit.CONDITION


def test_slider_rises_in_the_middle_of_a_line():
    """Both ends of the line are inside, but between them the arm comes upright."""
    workspace = WORKSPACES["plain"]
    start, end = (-0.1, 0.17, 0.51), (0.1, 0.17, 0.51)
    workspace.check_position(start)
    workspace.check_position(end)
    with pytest.raises(OutsideWorkspaceError) as caught:
        workspace.check_segment(start, end)
    error = caught.value
    assert (error.limit, error.arm) == (WorkspaceLimit.UPPER_TRAVEL, 0)
    assert error.value == pytest.approx(MACHINE.inverse((0.0, 0.17, 0.51))[0], abs=1e-9)
    assert MACHINE.inverse(error.position)[0] == pytest.approx(0.9, abs=1e-8)
    assert error.position[0] < 0.0


@pytest.mark.parametrize("bounded", ["box_upper", "upper_heights"])
def test_brief_excursion_between_samples_is_found(bounded):
    """A path that touches the outside for a moment only, wherever that moment lies."""
    rise = math.sqrt(0.4**2 - 0.2**2)
    bound = {"box_upper": (1.0, 1.0, 0.3), "upper_heights": (0.3 + rise,) * 3}[bounded]
    workspace = Workspace(MACHINE, replace(DEFAULT_LIMITS, **{bounded: bound}))
    for moment in np.linspace(0.05, 0.95, 19):
        for excess, refused in ((2.5 * TOLERANCE, True), (-2.5 * TOLERANCE, False)):
            top, width = 0.3 + rise + excess, 0.1

            def state(time, moment=moment, top=top, width=width):
                away = (time - moment) / width
                height = top - 0.05 * (1.0 - 1.0 / (1.0 + away * away))
                rate = -0.1 * away / (1.0 + away * away) ** 2 / width
                return SliderMotionState((height,) * 3, (rate,) * 3)

            accepted = accepts(workspace.check_path, state, 1.0, math.sqrt(3.0) * 0.1 / width**2)
            assert accepted != refused


def test_path_that_stands_still():
    workspace = WORKSPACES["plain"]
    workspace.check_path(lambda time: SliderMotionState((0.6,) * 3, (0.0,) * 3), 0.0, 1.0)
    workspace.check_path(lambda time: SliderMotionState((0.6,) * 3, (0.0,) * 3), 5.0, 0.0)
    workspace.check_segment((0.0, 0.0, 0.2), (0.0, 0.0, 0.2))
    with pytest.raises(OutsideWorkspaceError):
        workspace.check_path(lambda time: SliderMotionState((0.2,) * 3, (0.0,) * 3), 0.0, 1.0)


class TestAtTheEdge:
    """A machine that stands at, or beyond, the edge can be driven back."""

    def test_targets_on_the_edge_are_inside(self):
        workspace = WORKSPACES["box"]
        corner = (0.05, 0.05, workspace.limits.box_upper[2])
        workspace.check_position(corner)
        workspace.check_segment(corner, (-0.05, 0.05, corner[2]))
        workspace.check_segment(corner, (0.0, 0.0, 0.2))
        rise = math.sqrt(0.4**2 - 0.2**2)
        top = (0.0, 0.0, 0.9 - rise)
        WORKSPACES["plain"].check_position(top)
        WORKSPACES["plain"].check_heights((0.9, 0.9, 0.9))
        WORKSPACES["plain"].check_segment(top, (0.0, 0.0, 0.3))
        _, state, acceleration = smooth_path((0.9, 0.8, 0.8), (0.9, 0.85, 0.75), (0,) * 3, 1.0)
        WORKSPACES["plain"].check_path(state, 1.0, acceleration)

    def test_lines_may_end_on_the_edge(self):
        rng = np.random.default_rng(20)
        box, cylinder = WORKSPACES["box"], WORKSPACES["cylinder"]
        for start in inside_positions(box, rng, many(60)):
            end = np.array((*rng.uniform(-0.06, 0.06, 2), rng.uniform(0.2, 0.3)))
            for axis in range(3):
                for corner in (box.limits.box_lower, box.limits.box_upper):
                    on_face = np.where(np.arange(3) == axis, corner, end)
                    if is_inside(box, on_face):
                        box.check_segment(start, nudged(rng, on_face))
        for start in inside_positions(cylinder, rng, many(60)):
            angle = rng.uniform(0.0, math.tau)
            x = CYLINDER.center_x + CYLINDER.radius * math.cos(angle)
            y = CYLINDER.center_y + CYLINDER.radius * math.sin(angle)
            cylinder.check_segment(start, nudged(rng, (x, y, 0.3)))

    def test_lines_may_end_where_slider_travel_does(self):
        rng = np.random.default_rng(21)
        workspace = WORKSPACES["plain"]
        checked = 0
        for start in inside_positions(workspace, rng, many(40)):
            for arm in range(3):
                for end_of_travel, inwards in ((0.3, 1.0), (0.9, -1.0)):
                    heights = np.full(3, end_of_travel) + inwards * rng.uniform(0.0, 0.1, 3)
                    heights[arm] = end_of_travel
                    end = MACHINE.forward(heights)
                    if not workspace.exit_distance(end, np.subtract(start, end), 1e-3):
                        continue
                    # The way there may lead past the upper end, as a slider rises on its way.
                    reached = workspace.exit_distance(start, np.subtract(end, start), 9.0)
                    if reached > math.dist(start, end) - 1e-6:
                        workspace.check_segment(start, nudged(rng, end))
                        checked += 1
        assert checked > 80

    def test_lines_may_run_along_a_face(self):
        rng = np.random.default_rng(22)
        workspace = Workspace(MACHINE, replace(DEFAULT_LIMITS, box_lower=(-0.1, -0.1, 0.2)))
        for _ in range(many(100)):
            x, y, end_x, end_y = rng.uniform(-0.06, 0.06, 4)
            start, end = nudged(rng, (x, y, 0.2)), nudged(rng, (end_x, end_y, 0.2))
            workspace.check_segment(start, end)
            assert workspace.exit_distance(start, end - start, 0.01) == 0.01

    def test_which_limit_of_a_corner_is_named_is_not_left_to_rounding(self):
        rng = np.random.default_rng(23)
        machine = TriGlide(TriGlideGeometry.symmetric(0.25, 0.05, 0.4, math.radians(180.0)))
        limits = replace(DEFAULT_LIMITS, max_condition_number=1e6)
        workspace = Workspace(machine, limits)
        # Arms 2 and 3 are as far away.
        arms = set()
        for _ in range(200):
            with pytest.raises(OutsideWorkspaceError) as caught:
                workspace.check_segment((0.0, 0.0, 0.3), nudged(rng, (0.0, -0.31, 0.3)))
            arms.add((caught.value.limit, caught.value.arm))
        assert len(arms) == 1

    def test_from_the_edge_only_the_way_out_is_closed(self):
        workspace = WORKSPACES["box"]
        edge = (0.0, 0.0, workspace.limits.box_upper[2])
        assert workspace.exit_distance(edge, (0.0, 0.0, 1.0), 1.0) <= TOLERANCE
        assert workspace.exit_distance(edge, (0.0, 0.0, -1.0), 0.1) == pytest.approx(0.1)
        assert workspace.exit_distance(edge, (1.0, 0.0, 0.0), 0.1) == pytest.approx(0.1)

    @every_workspace
    def test_way_back_from_where_a_jog_ended(self, workspace):
        rng = np.random.default_rng(8)
        for start in inside_positions(workspace, rng, 30):
            direction = rng.normal(size=3)
            direction /= np.linalg.norm(direction)
            distance = workspace.exit_distance(start, direction.tolist(), 2.0)
            end = (start + distance * direction).tolist()
            back = workspace.exit_distance(end, (-direction).tolist(), distance)
            assert back == pytest.approx(distance, abs=1e-12)

    @pytest.mark.parametrize(
        ("name", "position"),
        [
            ("plain", (0.0, 0.0, -0.06)),
            ("plain", (0.0, 0.0, 0.56)),
            ("plain", (0.0, -0.1955, 0.25)),
            ("conditioning", (0.0, -0.14, 0.25)),
            ("box", (0.12, 0.0, 0.41)),
            ("cylinder", (0.11, 0.05, 0.46)),
        ],
    )
    def test_outside_things_may_not_get_worse(self, name, position):
        workspace = WORKSPACES[name]
        outside = np.array(position)
        with pytest.raises(OutsideWorkspaceError):
            workspace.check_position(position)
        assert workspace.exit_distance(position, (0.0, 0.0, 1.0), 1.0) == 0.0
        heights = MACHINE.inverse(position)
        widened = workspace.widened_to(heights)
        assert widened.limits == workspace.limits
        center = np.array((0.0, 0.0, 0.25))
        widened.check_position(position)
        widened.check_segment(position, center.tolist())
        inwards, way = center - outside, float(np.linalg.norm(center - outside))
        assert widened.exit_distance(position, inwards.tolist(), way) == pytest.approx(way)
        goal = MACHINE.inverse(center.tolist())
        _, state, acceleration = smooth_path(heights, goal, (0,) * 3, 1.0)
        widened.check_path(state, 1.0, acceleration)
        further = (outside - 0.002 * inwards / way).tolist()
        with pytest.raises(KinematicsError):
            widened.check_position(further)
        with pytest.raises(KinematicsError):
            widened.check_segment(position, further)
        assert widened.exit_distance(position, (-inwards).tolist(), 1.0) <= 2.0 * TOLERANCE

    def test_inside_nothing_is_widened(self):
        workspace = WORKSPACES["cylinder"]
        widened = workspace.widened_to((0.6, 0.6, 0.6))
        rng = np.random.default_rng(9)
        for position in rng.uniform((-0.3, -0.3, -0.1), (0.3, 0.3, 0.6), (500, 3)).tolist():
            found = is_inside(widened, position)
            assert found == is_inside(workspace, position)


class TestLimitsAsASet:
    def test_workspace_is_a_value(self):
        again = Workspace(TriGlide(DEFAULT_GEOMETRY), replace(DEFAULT_LIMITS))
        plain = WORKSPACES["plain"]
        assert again == plain
        assert hash(again) == hash(plain)
        assert plain != WORKSPACES["box"]
        assert plain != plain.widened_to((0.2, 0.3, 0.3))
        assert plain.widened_to((0.4, 0.4, 0.4)) == plain

    def test_is_a_value_of_plain_floats(self):
        limits = WorkspaceLimits(np.zeros(3), [1, 1, 1], 0, 5, box_lower=np.zeros(3))
        assert limits == WorkspaceLimits((0.0,) * 3, (1.0,) * 3, 0.0, 5.0, box_lower=(0.0,) * 3)
        assert all(type(h) is float for h in (*limits.upper_heights, *limits.box_lower))
        assert hash(DEFAULT_LIMITS) == hash(replace(DEFAULT_LIMITS))

    @pytest.mark.parametrize(
        ("changes", "error", "text"),
        [
            ({"lower_heights": (0.3, 0.9, 0.3)}, OutOfBoundsError, r"upper_heights\[1\] = 0.9 m"),
            ({"lower_heights": 0.3}, WrongShapeError, r"lower_heights has shape \(\), expected"),
            ({"reach_margin": None}, NotANumberError, "reach_margin = None is not a number"),
            ({"upper_heights": (0.9, 0.9)}, WrongShapeError, "upper_heights has shape"),
            ({"lower_heights": (0.3, math.nan, 0.3)}, NotFiniteError, r"lower_heights\[1\] = nan"),
            ({"reach_margin": -0.1}, OutOfBoundsError, "reach_margin = -0.1 m must be at least 0"),
            ({"reach_margin": math.inf}, NotFiniteError, "reach_margin"),
            ({"max_condition_number": 1.0}, OutOfBoundsError, "must be greater than 1"),
            ({"max_condition_number": math.nan}, NotFiniteError, "max_condition_number"),
            ({"box_lower": (0,) * 3, "box_upper": (1, 1, 0)}, OutOfBoundsError, "than box_lower"),
            ({"box_lower": (0, 0)}, WrongShapeError, "box_lower has shape"),
            ({"box_upper": (0, math.inf, 0)}, NotFiniteError, r"box_upper\[1\] = inf"),
        ],
    )
    def test_what_does_not_fit_is_refused(self, changes, error, text):
        with pytest.raises(error, match=text):
            replace(DEFAULT_LIMITS, **changes)

    @pytest.mark.parametrize(
        ("numbers", "error", "text"),
        [
            ((0, 0, 0.0, 0, 1), OutOfBoundsError, "cylinder radius = 0 m"),
            ((0, 0, 1, 1, 1), OutOfBoundsError, "cylinder z_max = 1 m must be greater than"),
            ((math.nan, 0, 1, 0, 1), NotFiniteError, "cylinder center_x"),
            ((0, 0, 1, 0, math.inf), NotFiniteError, "cylinder z_max"),
        ],
    )
    def test_cylinder(self, numbers, error, text):
        with pytest.raises(error, match=text):
            Cylinder(*numbers)
