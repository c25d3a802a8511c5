"""Moves that tell the most of masses and friction, each of them verified."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import islice
from typing import NamedTuple

import numpy as np

from tri_glide_kinematics.checks import positive
from tri_glide_kinematics.dynamics import UNIFORM_ARMS, regressor
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionKind, SliderLimits, Trajectory, plan_move
from tri_glide_kinematics.motion.shaping import Shaping
from tri_glide_kinematics.motion.trajectory import SequencePlan
from tri_glide_kinematics.vectors import FloatArray, Vector3, three
from tri_glide_kinematics.workspace import Workspace

# All moves together take so long at most [s].
LONGEST = 3600.0

# Targets that are compared for each move, and how many are tried before a workspace is given up.
CANDIDATES = 10
TRIALS = 1000
# Between the setpoints of which the worth of a move is judged [s].
STEP = 0.01
# Information before the first move, so that moves that tell not of all can be compared.
A_LITTLE = 1e-6


class NoMovesError(KinematicsError):
    """No moves were found in a workspace."""

    def __init__(self, trials: int) -> None:
        """Store the number of ``trials``."""
        super().__init__(f"of {trials} places at random, none can be moved to in the workspace")
        self.trials = trials


class Excitation(NamedTuple):
    """Moves from rest to rest, one after the other.

    Attributes:
        positions: where the moves begin and end. Shape (n, 3) [m].
        trajectory: all moves.
    """

    positions: tuple[Vector3, ...]
    trajectory: Trajectory


def exciting_moves(
    workspace: Workspace,
    limits: SliderLimits,
    duration: float = 60.0,
    *,
    start: Sequence[float] | None = None,
    seed: int = 0,
    kind: MotionKind = MotionKind.SLIDER,
    shaper: Shaping | None = None,
) -> Excitation:
    """Return moves from which masses and friction can be told.

    Each next move is the one, of some to places at random, that adds the most to what is known: it
    makes the determinant of the information largest (a D-optimal choice).

    Args:
        workspace: in which they stay.
        limits: of the sliders, which are used up: higher accelerations tell more.
        duration: of all moves together, at least; an hour at most [s].
        start: where the first one begins; anywhere without it. Shape (3,) [m].
        seed: of the places.
        kind: of the moves.
        shaper: with which they are driven; None without one.

    Raises:
        KinematicsError: if ``start`` is outside the workspace, or the duration not from 0 to an
            hour.
        NoMovesError: if no moves are found.
    """
    left = positive("duration", duration, "s", LONGEST)
    rng = np.random.default_rng(seed)
    if start is None:
        place = next(_places(workspace, rng), None)
        if place is None:
            raise NoMovesError(TRIALS)
    else:
        workspace.check_position(start)
        place = three(start)
    positions, moves = [place], []
    known = A_LITTLE * np.eye(len(UNIFORM_ARMS))
    while left > 0.0:
        found = []
        moving = partial(plan_move, workspace, limits, place, kind=kind, shaper=shaper)
        for end, move in islice(_moves(workspace, moving, rng), CANDIDATES):
            rows = _information(workspace, move)
            gain = np.linalg.slogdet(known + rows)[1] - np.linalg.slogdet(known)[1]
            # For the time that it takes.
            found.append((gain / move.duration, end, move, rows))
        if not found:
            raise NoMovesError(TRIALS)
        _, place, best, rows = max(found, key=lambda each: each[0])
        known = known + rows
        positions.append(place)
        moves.append(best)
        left -= best.duration
    return Excitation(tuple(positions), SequencePlan(moves))


def _places(workspace: Workspace, rng: np.random.Generator) -> Iterator[Vector3]:
    """Yield those of some places at random that are in the workspace."""
    lower, upper = workspace.limits.lower_heights, workspace.limits.upper_heights
    for _ in range(TRIALS):
        with suppress(KinematicsError):
            yield workspace.check_heights(rng.uniform(lower, upper).tolist())


def _moves(
    workspace: Workspace, moving: Callable[[Vector3], Trajectory], rng: np.random.Generator
) -> Iterator[tuple[Vector3, Trajectory]]:
    """Yield such places, and the moves to them, where there are any."""
    for place in _places(workspace, rng):
        with suppress(KinematicsError):
            yield place, moving(place)


def _information(workspace: Workspace, move: Trajectory) -> FloatArray:
    """Return the squares of the regressor of a move."""
    _, heights, velocities, accelerations = move.sample(np.arange(0.0, move.duration, STEP))
    rows = regressor(workspace.machine, heights, velocities, accelerations)
    rows = rows[np.isfinite(rows).all(axis=(1, 2))]
    return np.asarray(np.einsum("nij,nik->jk", rows, rows))
