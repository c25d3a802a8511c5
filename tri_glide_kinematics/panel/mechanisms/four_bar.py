"""A four-bar linkage of a file: what to ask about it, and what is drawn of the answers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tri_glide_interfaces.msg import CrankSweep, FourBarDeadCentre, FourBarPose, Point2
from tri_glide_interfaces.msg import FourBar as FourBarMessage
from tri_glide_interfaces.srv import SolveFourBar, TraceFourBar
from tri_glide_kinematics.mechanisms import MechanismFile
from tri_glide_kinematics.mechanisms.four_bar import AssembledFourBar, Branch, FourBar
from tri_glide_kinematics.mechanisms.pictures import FOUR_BAR, side_by_side
from tri_glide_kinematics.panel.mechanisms.picture import Branch as FollowedBranch
from tri_glide_kinematics.panel.mechanisms.picture import Mark, Position, Track, degrees_text
from tri_glide_kinematics.panel.mechanisms.questions import Dimension, coordinate, length
from tri_glide_kinematics.vectors import FloatArray, Point

STEP = math.radians(0.5)  # of the crank, between two rows of a trace
BRANCH_NAMES = {FourBarPose.OPEN: "open", FourBarPose.CROSSED: "crossed"}
LIMIT = "The crank gets no farther"
ROCKER_END = "The rocker turns back"
ROCKER_ENDS = (FourBarDeadCentre.CRANK_COUPLER_STRETCHED, FourBarDeadCentre.CRANK_COUPLER_FOLDED)


class FourBarQuestions:
    """The ``Questions`` about a four-bar linkage; the key of a position is its branch."""

    solve_service = SolveFourBar
    trace_service = TraceFourBar
    skeleton = FOUR_BAR
    paths: tuple[int, ...] = (4, 2)  # the coupler curve, and the way of the rocker pin

    def __init__(self, file: MechanismFile, linkage: FourBar) -> None:
        """Ask about the ``linkage`` that a ``file`` holds."""
        self._linkage = linkage
        size = linkage.coupler
        x, y = file.coupler_point
        self.dimensions: tuple[Dimension, ...] = (
            length("crank", linkage.crank),
            length("coupler", linkage.coupler),
            length("rocker", linkage.rocker),
            length("ground", linkage.ground),
            coordinate("point along the coupler", x, size),
            coordinate("point beside the coupler", y, size),
        )
        low, high = linkage.crank_ranges[0]
        # In the middle of a full turn, the crank lies on the ground.
        self.crank_angle = low + (high - low) * (0.7 if linkage.crank_turns_fully else 0.5)
        self.key = float(FourBarPose.OPEN)
        if isinstance(linkage, AssembledFourBar):
            self.crank_angle = linkage.assembled_crank_angle
            if linkage.assembled_branch is Branch.CROSSED:
                self.key = float(FourBarPose.CROSSED)

    def pivots(self, values: Sequence[float]) -> FloatArray:
        """Return the joints that do not move. Shape (2, 2) [m]."""
        return self._pivots(values[3])

    def _pivots(self, ground: float) -> FloatArray:
        x, y = self._linkage.crank_pivot
        angle = self._linkage.ground_angle
        return np.array([(x, y), (x + ground * math.cos(angle), y + ground * math.sin(angle))])

    def solve_request(self, values: Sequence[float], crank_angle: float) -> SolveFourBar.Request:
        """Ask for all positions at a crank angle [rad]."""
        return SolveFourBar.Request(
            linkage=self._message(values), crank_angle=crank_angle, coupler_point=_point(values)
        )

    def positions(self, answer: SolveFourBar.Response) -> tuple[Position, ...]:
        """Return the positions of an answer."""
        return tuple(_position(pose) for pose in answer.poses)

    def distance(self, key: float, other: float) -> float:
        """Return how far apart two positions at one crank angle are."""
        return abs(key - other)

    def trace_request(
        self,
        values: Sequence[float],
        crank_angle: float,
        key: float,
        answer: SolveFourBar.Response,
    ) -> TraceFourBar.Request:
        """Ask for the branch that passes the position ``key``, from limit to limit or once around.

        The position was answered at this crank angle [rad].
        """
        low, high = _range_around(crank_angle, answer)
        return TraceFourBar.Request(
            linkage=self._message(values),
            branch=round(key),
            sweep=CrankSweep(
                start_angle=low, end_angle=high, steps=max(2, math.ceil((high - low) / STEP))
            ),
            coupler_point=_point(values),
        )

    def branch(
        self, request: TraceFourBar.Request, answer: TraceFourBar.Response
    ) -> FollowedBranch | None:
        """Return the branch of an answer, or none if it is a single position."""
        angles = np.array(answer.crank_angle)
        pins = np.stack([answer.rocker_pin_x, answer.rocker_pin_y], axis=1)
        crank_pivot, rocker_pivot = self._pivots(request.linkage.ground)
        points = side_by_side(
            crank_pivot,
            np.stack([answer.crank_pin_x, answer.crank_pin_y], axis=1),
            pins,
            rocker_pivot,
            np.stack([answer.coupler_point_x, answer.coupler_point_y], axis=1),
        )
        # A row on a limit may lie beyond it by rounding.
        known = np.isfinite(pins).all(axis=1)
        angles, pins, points = angles[known], pins[known], points[known]
        if angles.size < 2:
            return None
        full = answer.properties.crank_turns_fully
        ends = () if full else (0, -1)
        marks = [Mark(_pair(pins[row]), LIMIT, float(angles[row])) for row in ends]
        marks += [
            Mark(_place_at(centre.crank_angle, angles, pins), ROCKER_END, centre.crank_angle)
            for centre in answer.properties.dead_centres
            if centre.kind in ROCKER_ENDS
            and centre.branch in (request.branch, FourBarPose.BOTH)
            and (centre.crank_angle - angles[0]) % math.tau <= angles[-1] - angles[0]
        ]
        return FollowedBranch(
            Track(angles, np.full(angles.size, float(request.branch)), closed=full),
            points,
            tuple(marks),
            _words(answer),
        )

    def _message(self, values: Sequence[float]) -> FourBarMessage:
        linkage = self._linkage
        crank, coupler, rocker, ground = values[:4]
        x, y = linkage.crank_pivot
        return FourBarMessage(
            crank=crank,
            coupler=coupler,
            rocker=rocker,
            ground=ground,
            ground_angle=linkage.ground_angle,
            crank_pivot=Point2(x=x, y=y),
            tolerance=linkage.tolerance,
        )


def _point(values: Sequence[float]) -> Point2:
    return Point2(x=values[4], y=values[5])


def _position(pose: FourBarPose) -> Position:
    joints = (pose.crank_pivot, pose.crank_pin, pose.rocker_pin, pose.rocker_pivot)
    points = np.array([(joint.x, joint.y) for joint in (*joints, pose.coupler_point)])
    text = (
        f"{BRANCH_NAMES[pose.branch]}, transmission angle {degrees_text(pose.transmission_angle)}"
    )
    return Position(float(pose.branch), points, text)


def _range_around(crank_angle: float, answer: SolveFourBar.Response) -> tuple[float, float]:
    """Return the crank's limits around a crank angle [rad]."""
    properties = answer.properties
    ranges = list(zip(properties.crank_range_begin, properties.crank_range_end))
    for low, high in ranges:
        if (crank_angle - low) % math.tau <= high - low:
            return low, high
    # On a limit, by rounding beyond it.
    return min(
        ranges,
        key=lambda ends: min(abs(math.remainder(crank_angle - end, math.tau)) for end in ends),
    )


def _place_at(crank_angle: float, angles: FloatArray, pins: FloatArray) -> Point:
    offsets = np.abs(np.remainder(angles - crank_angle + math.pi, math.tau) - math.pi)
    return _pair(pins[int(offsets.argmin())])


def _pair(point: FloatArray) -> Point:
    return float(point[0]), float(point[1])


def _words(answer: TraceFourBar.Response) -> str:
    properties = answer.properties
    turns = "turns fully" if properties.crank_turns_fully else "does not turn fully"
    low = degrees_text(properties.smallest_transmission_angle)
    high = degrees_text(properties.largest_transmission_angle)
    name = properties.grashof_class.capitalize()
    return f"{name}: the crank {turns}. Transmission angle {low} to {high}."
