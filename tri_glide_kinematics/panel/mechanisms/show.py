"""One mechanism on show: solved anew when a number changes, and turned along a branch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor, Future

from tri_glide_kinematics.equal_numbers import first_smallest
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.mechanisms.questions import Branch, Position, Shown
from tri_glide_kinematics.vectors import FloatArray

Values = tuple[float, ...]


class Show:
    """Keeps what is known about one mechanism, and which of its branches is followed.

    Each change has all positions found anew at the present crank angle. If the followed branch is
    not known for these dimensions, it is traced from one of them, which takes longer: beside all
    else, one at a time, and of several that are wanted the newest. All calls come from one thread.

    Attributes:
        mechanism: that is on show.
        positions: all at the present crank angle.
        followed: index of the one on the followed branch; None if it has none at this angle.
        branch: the followed one; None before it is known.
        crank_angle: the present one; full turns do not matter [rad].
    """

    def __init__(self, mechanism: Shown, worker: Executor) -> None:
        """Show it as it is in its file; the ``worker`` traces its branches."""
        self.mechanism = mechanism
        self._worker = worker
        self._refusals = {"positions": "", "branch": ""}
        self._values: Values = tuple(item.value for item in mechanism.dimensions)
        self.positions: tuple[Position, ...] = ()
        self.followed: int | None = None
        # Dimensions for which a branch is known, or wanted.
        self._traced: Values | None = None
        self.branch: Branch | None = None
        self._key = mechanism.key
        self._place = 0.0
        self._on_branch = True
        self._forward = True
        self.crank_angle = mechanism.crank_angle
        self._is_solved = False
        # The position whose branch is wanted, and whose branch is being traced: its dimensions,
        # crank angle and key.
        self._wanted: tuple[Values, float, float] | None = None
        self._tracing: tuple[float, Future[Branch | None]] | None = None

    @property
    def pivots(self) -> FloatArray:
        """The joints that do not move. Shape (k, 2) [m]."""
        return self.mechanism.pivots(self._values)

    @property
    def problem(self) -> str:
        """Why there are no positions or no branch, in words, or nothing."""
        return next(filter(None, self._refusals.values()), "")

    @property
    def words(self) -> str:
        """The text of the drawing: a paragraph on the branch and one on the position."""
        branch = self.branch
        paragraphs = [] if branch is None else [f"{branch.text} {branch.events}".strip()]
        count = len(self.positions)
        if self.followed is not None:
            text = self.positions[self.followed].text
            paragraphs.append(f"Position {self.followed + 1} of {count}: {text}.")
        elif count:
            paragraphs.append("The followed branch does not come to this crank angle.")
        return "\n\n".join(paragraphs)

    def change(self, values: Sequence[float]) -> None:
        """Take other dimensions [m], [rad]."""
        if tuple(values) != self._values:
            self._values = tuple(values)
            self._is_solved = False

    def turn(self, by: float) -> None:
        """Turn the crank by an angle [rad], and with it the followed position as far as it goes."""
        self.crank_angle += by
        self._find_place()
        self._is_solved = False

    def advance(self, way: float) -> None:
        """Turn the crank on by ``way`` [rad] along the branch, back where the crank must."""
        if self.branch is None:
            return
        track = self.branch.track
        self._place, self._forward = track.advanced(self._place, way, self._forward)
        self._key = track.key(self._place)
        self.crank_angle = track.crank_angle(self._place)
        self._on_branch = True
        self._is_solved = False

    def follow_next(self) -> None:
        """Follow the next one of the positions at this crank angle."""
        if not self._is_solved:
            self._solve()
        if self.positions:
            before = -1 if self.followed is None else self.followed
            self.followed = (before + 1) % len(self.positions)
            self._key = self.positions[self.followed].key
            self.branch, self._on_branch = None, True
            self._want_branch()

    def step(self) -> bool:
        """Find out what is not known yet, and return whether something is new."""
        is_new = not self._is_solved
        if is_new:
            self._solve()
        if self._tracing is not None and self._tracing[1].done():
            (crank_angle, traced), self._tracing = self._tracing, None
            self._take_branch(crank_angle, traced)
            is_new = True
        if self._tracing is None and self._wanted is not None:
            wanted, self._wanted = self._wanted, None
            self._tracing = wanted[1], self._worker.submit(self.mechanism.branch, *wanted)
        return is_new

    def _solve(self) -> None:
        self._is_solved = True
        self.positions, self.followed = (), None
        self._refusals["positions"] = ""
        is_other = self._values != self._traced
        try:
            self.positions = self.mechanism.positions(self._values, self.crank_angle)
        except KinematicsError as error:
            self._refusals["positions"] = str(error)
            if is_other:
                # Nothing is known of the branches of a mechanism of these dimensions.
                self.branch, self._traced, self._on_branch = None, None, True
                self._refusals["branch"] = ""
            return
        if self._on_branch or is_other:
            distances = [self.mechanism.distance(self._key, item.key) for item in self.positions]
            self.followed = first_smallest(distances)
        if is_other:
            self._want_branch()

    def _want_branch(self) -> None:
        """Have the branch of the followed position traced."""
        assert self.followed is not None
        self._traced = self._values
        self._wanted = self._values, self.crank_angle, self.positions[self.followed].key

    def _take_branch(self, crank_angle: float, traced: Future[Branch | None]) -> None:
        self.branch, self._refusals["branch"] = None, ""
        try:
            self.branch = traced.result()
        except KinematicsError as error:
            self._refusals["branch"] = str(error)
        if self.branch is None:
            # Another position may have one.
            self._traced = None
            return
        track = self.branch.track
        self._place = track.place_of(crank_angle)
        self._forward = True
        # From there it goes on to where the crank is by now, in the full turns of the track.
        turns = round((track.crank_angle(self._place) - crank_angle) / math.tau)
        self.turn(turns * math.tau)

    def _find_place(self) -> None:
        """Go along the branch to the present crank angle, or stay where it cannot go on."""
        if self.branch is None:
            return
        track = self.branch.track
        place = track.turned(self._place, self.crank_angle - track.crank_angle(self._place))
        self._on_branch = place is not None
        if place is not None:
            self._place, self._key = place, track.key(place)
            self.crank_angle = track.crank_angle(place)
