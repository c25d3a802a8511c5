"""An F-mechanism of a file: what to ask about it, and what is drawn of the answers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from tri_glide_interfaces.msg import CrankSweep, FMechanismPose, Point2, TraceEvent
from tri_glide_interfaces.msg import FMechanism as FMechanismMessage
from tri_glide_interfaces.srv import SolveFMechanism, TraceFMechanism
from tri_glide_kinematics.equal_numbers import first_largest
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism
from tri_glide_kinematics.mechanisms.pictures import F_MECHANISM, side_by_side
from tri_glide_kinematics.panel.mechanisms.picture import (
    Branch,
    Mark,
    Position,
    Track,
    degrees_text,
)
from tri_glide_kinematics.panel.mechanisms.questions import Dimension, length, phase
from tri_glide_kinematics.vectors import FloatArray

STEPS = 720  # of the crank in a full turn, between the rows of a trace
LETTERS = "ABC"
# A start is looked for at so many crank angles.
STARTS = 36
# Branches that turn fully, and those that turn back, are closed by then.
TURNS = 2
MARKED = {
    TraceEvent.TURNING_POINT: "The cranks turn back",
    TraceEvent.BIFURCATION: "Branches meet",
    TraceEvent.SINGULAR: "The continuation is not unique",
}
TURNS_FULLY = {
    TraceFMechanism.Response.YES: "The cranks turn fully on this branch.",
    TraceFMechanism.Response.NO: "The cranks cannot turn fully on this branch.",
    TraceFMechanism.Response.UNDECIDED: f"The branch does not close within {TURNS} turns.",
}


class FMechanismQuestions:
    """The ``Questions`` about an F-mechanism; the key of a position is its angle [rad]."""

    solve_service = SolveFMechanism
    trace_service = TraceFMechanism
    skeleton = F_MECHANISM
    paths: tuple[int, ...] = (6, 7, 8)  # of the corners of the platform

    def __init__(self, mechanism: FMechanism) -> None:
        """Ask about the ``mechanism`` of a file."""
        linkage = mechanism.linkage
        self._base = [(pivot.real, pivot.imag) for pivot in linkage.pivots]
        self._platform = [(joint.real, joint.imag) for joint in linkage.joints]
        self._counter_rotating = linkage.speeds[1] < 0.0
        self.dimensions: tuple[Dimension, ...] = (
            *(length(f"crank {letter}", r) for letter, r in zip(LETTERS, linkage.cranks)),
            *(length(f"rod {letter}", r) for letter, r in zip(LETTERS, linkage.rods)),
            phase("phase B", mechanism.phase_b),
            phase("phase C", mechanism.phase_c),
        )
        angles = np.arange(STARTS) * math.tau / STARTS
        counts = [len(mechanism.poses(angle)) for angle in angles]
        self.crank_angle = float(angles[first_largest(counts)])
        self.key = 0.0

    def pivots(self, values: Sequence[float]) -> FloatArray:
        """Return the joints that do not move. Shape (3, 2) [m]."""
        del values
        return np.array(self._base)

    def solve_request(self, values: Sequence[float], crank_angle: float) -> SolveFMechanism.Request:
        """Ask for all positions at a crank angle [rad]."""
        return SolveFMechanism.Request(mechanism=self._message(values), crank_angle=crank_angle)

    def positions(self, answer: SolveFMechanism.Response) -> tuple[Position, ...]:
        """Return the positions of an answer."""
        return tuple(self._position(pose) for pose in answer.poses)

    def distance(self, key: float, other: float) -> float:
        """Return how far apart two positions at one crank angle are [rad]."""
        return abs(math.remainder(key - other, math.tau))

    def trace_request(
        self,
        values: Sequence[float],
        crank_angle: float,
        key: float,
        answer: SolveFMechanism.Response,
    ) -> TraceFMechanism.Request:
        """Ask for the branch that passes the position ``key``, through its turning points.

        The position was answered at this crank angle [rad].
        """
        del answer
        return TraceFMechanism.Request(
            mechanism=self._message(values),
            sweep=CrankSweep(
                start_angle=crank_angle,
                end_angle=crank_angle + TURNS * math.tau,
                steps=TURNS * STEPS,
            ),
            start_by=TraceFMechanism.Request.BY_ANGLE,
            pose_angle=key,
            go_through=True,
        )

    def branch(
        self, request: TraceFMechanism.Request, answer: TraceFMechanism.Response
    ) -> Branch | None:
        """Return the branch of an answer, or none if it is a single position."""
        del request
        if len(answer.crank_angle) < 2:
            return None
        moving = [
            np.stack([getattr(answer, f"{name}_x"), getattr(answer, f"{name}_y")], axis=1)
            for name in ("a1", "b1", "c1", "a2", "b2", "c2")
        ]
        return Branch(
            _track(answer),
            side_by_side(*self._base, *moving),
            _marks(answer),
            TURNS_FULLY[answer.turns_fully],
        )

    def _message(self, values: Sequence[float]) -> FMechanismMessage:
        return FMechanismMessage(
            base=[Point2(x=x, y=y) for x, y in self._base],
            crank_lengths=values[:3],
            rod_lengths=values[3:6],
            platform=[Point2(x=x, y=y) for x, y in self._platform],
            phase_b=values[6],
            phase_c=values[7],
            counter_rotating=self._counter_rotating,
        )

    def _position(self, pose: FMechanismPose) -> Position:
        joints = (*pose.crank_pins, *pose.platform_joints)
        points = np.array([*self._base, *((joint.x, joint.y) for joint in joints)])
        return Position(pose.angle, points, f"platform at {degrees_text(pose.angle)}")


def _track(answer: TraceFMechanism.Response) -> Track:
    """Return the way along a branch, its turning points included."""
    angles, keys = np.array(answer.crank_angle), np.array(answer.angle)
    turning = [event for event in answer.events if event.kind == TraceEvent.TURNING_POINT]
    behind = [event.row + 1 for event in turning]
    turned = [
        # Of an event, the angle of the platform is not counted on over full turns.
        keys[event.row] + math.remainder(event.angle - keys[event.row], math.tau)
        for event in turning
    ]
    closed = any(event.kind == TraceEvent.CLOSED for event in answer.events)
    return Track(
        np.insert(angles, behind, [event.crank_angle for event in turning]),
        np.insert(keys, behind, turned),
        closed,
    )


def _marks(answer: TraceFMechanism.Response) -> tuple[Mark, ...]:
    marks = (
        Mark((event.position.x, event.position.y), MARKED[event.kind], event.crank_angle)
        for event in answer.events
        if event.kind in MARKED
    )
    # A branch that passes a place several times marks it once.
    return tuple({(mark.kind, mark.label): mark for mark in marks}.values())
