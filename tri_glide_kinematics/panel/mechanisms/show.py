"""One mechanism on show: asked anew when a number changes, and turned along a branch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.task import Future

from tri_glide_interfaces.srv import SolveFMechanism, SolveFourBar, TraceFMechanism, TraceFourBar
from tri_glide_kinematics.equal_numbers import first_smallest
from tri_glide_kinematics.panel.mechanisms.questions import Branch, Position, Questions
from tri_glide_kinematics.vectors import FloatArray

PATIENCE = 5.0  # s, until an answer is given up

_NAMES: dict[type, str] = {
    SolveFourBar: "solve_four_bar",
    TraceFourBar: "trace_four_bar",
    SolveFMechanism: "solve_f_mechanism",
    TraceFMechanism: "trace_f_mechanism",
}


@dataclass(frozen=True)
class Wish:
    """A request, and what the one who asks needs to know when the answer comes."""

    request: Any
    about: Any


class NewestRequest:
    """One request on its way, and the newest wish beyond it.

    A wish that is not sent yet gives way to a newer one: whoever drags a slider sees the answers
    that the server has time for, and the last one for certain. All calls come from the thread that
    spins the node.

    Attributes:
        problem: why there is no answer, or nothing.
    """

    def __init__(self, client: Any) -> None:
        """Ask through a ``client`` of rclpy."""
        self._client = client
        self._wish: Wish | None = None
        self._sent: tuple[Wish, Future, float] | None = None
        self.problem = ""

    def ask(self, request: Any, about: Any = None) -> None:
        """Have a request sent when no other is on its way; ``about`` comes with its answer."""
        self._wish = Wish(request, about)

    def take(self, time: float) -> tuple[Wish, Any] | None:
        """Return what was asked with the answer that has come, if one has; send what waits.

        ``time`` is of a steady clock [s].
        """
        answered = None
        if self._sent is not None:
            wish, future, sent_at = self._sent
            if future.done():
                answered, self._sent = (wish, future.result()), None
                self.problem = ""
            elif time - sent_at > PATIENCE:
                self._client.remove_pending_request(future)
                self._sent = None
                self._wish = self._wish or wish
                self.problem = f"mechanism_node has not answered for {PATIENCE:g} s"
        if self._sent is None and self._wish is not None:
            if self._client.service_is_ready():
                self._sent = self._wish, self._client.call_async(self._wish.request), time
                self._wish = None
            else:
                self.problem = "mechanism_node is not running"
        return answered


class MechanismRequests:
    """The clients of mechanism_node's services, made once and early.

    The first answer to a new client takes longer than those after it.
    """

    def __init__(self, node: Node) -> None:
        """Make clients on ``node`` of ``mechanism_node`` in the same namespace."""
        self._clients = {
            kind: node.create_client(kind, f"mechanism_node/{name}")
            for kind, name in _NAMES.items()
        }

    def newest_of(self, kind: type) -> NewestRequest:
        """Return a way to ask a service of one kind."""
        return NewestRequest(self._clients[kind])


Values = tuple[float, ...]


@dataclass(frozen=True)
class _Asked:
    """A request for positions.

    Attributes:
        values: of the dimensions [m], [rad].
        crank_angle: [rad].
        key: of the position that is on the followed branch; None if none is.
    """

    values: Values
    crank_angle: float
    key: float | None


class Show:
    """Keeps the answers about one mechanism, and which of its branches is followed.

    Each change asks for all positions at the present crank angle. When they have come, and the
    followed branch is not known for these dimensions, it is asked for from one of them. All calls
    come from one thread.

    Attributes:
        questions: about the mechanism.
        positions: all at the present crank angle.
        followed: index of the one on the followed branch; None if it has none at this angle.
        branch: the followed one; None before it is known.
        crank_angle: that was asked for last; full turns do not matter [rad].
    """

    def __init__(self, questions: Questions, requests: MechanismRequests) -> None:
        """Ask for the positions of the mechanism as it is in its file."""
        self.questions = questions
        self._solve = requests.newest_of(questions.solve_service)
        self._trace = requests.newest_of(questions.trace_service)
        self._refusals = {"positions": "", "branch": ""}
        self._values: Values = tuple(item.value for item in questions.dimensions)
        self._answer: Any = None
        self.positions: tuple[Position, ...] = ()
        self.followed: int | None = None
        self._traced: Values | None = None
        self.branch: Branch | None = None
        self._key = questions.key
        self._place = 0.0
        self._on_branch = True
        self._forward = True
        self.crank_angle = questions.crank_angle
        self._solved = _Asked(self._values, self.crank_angle, self._key)
        self._ask()

    @property
    def pivots(self) -> FloatArray:
        """The joints that do not move. Shape (k, 2) [m]."""
        return self.questions.pivots(self._solved.values)

    @property
    def problem(self) -> str:
        """Why there is no answer, in words, or nothing."""
        refusals = self._refusals.values()
        return self._solve.problem or self._trace.problem or next(filter(None, refusals), "")

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
            self._ask()

    def turn(self, by: float) -> None:
        """Turn the crank by an angle [rad], and with it the followed position as far as it goes."""
        self.crank_angle += by
        self._find_place()
        self._ask()

    def advance(self, way: float) -> None:
        """Turn the crank on by ``way`` [rad] along the branch, back where the crank must."""
        if self.branch is None:
            return
        track = self.branch.track
        self._place, self._forward = track.advanced(self._place, way, self._forward)
        self._key = track.key(self._place)
        self.crank_angle = track.crank_angle(self._place)
        self._on_branch = True
        self._ask()

    def follow_next(self) -> None:
        """Follow the next one of the positions at this crank angle."""
        if self.positions:
            before = -1 if self.followed is None else self.followed
            self.followed = (before + 1) % len(self.positions)
            self._key = self.positions[self.followed].key
            self.branch, self._on_branch = None, True
            self._ask_branch()

    def step(self, time: float) -> bool:
        """Take in what has been answered, send what waits, and return whether something is new.

        ``time`` is of a steady clock [s].
        """
        problem = self.problem
        solved, traced = self._solve.take(time), self._trace.take(time)
        if solved is not None:
            self._take_positions(*solved)
        if traced is not None:
            self._take_branch(*traced)
        return solved is not None or traced is not None or problem != self.problem

    def _ask(self) -> None:
        request = self.questions.solve_request(self._values, self.crank_angle)
        key = self._key if self._on_branch else None
        self._solve.ask(request, _Asked(self._values, self.crank_angle, key))

    def _take_positions(self, wish: Wish, answer: Any) -> None:
        asked: _Asked = wish.about
        self._solved, self._answer = asked, answer
        self._refusals["positions"] = answer.message
        self.positions = self.questions.positions(answer)
        self.followed = None
        if not self.positions:
            if asked.values != self._traced:
                # Nothing is known of the branches of a mechanism of these dimensions.
                self.branch, self._traced, self._on_branch = None, None, True
                self._refusals["branch"] = ""
            return
        if asked.key is not None or asked.values != self._traced:
            key = self._key if asked.key is None else asked.key
            distances = [self.questions.distance(key, item.key) for item in self.positions]
            self.followed = first_smallest(distances)
        if asked.values != self._traced:
            self._ask_branch()

    def _ask_branch(self) -> None:
        """Ask for the branch of the followed position."""
        assert self.followed is not None
        asked = self._solved
        key = self.positions[self.followed].key
        request = self.questions.trace_request(asked.values, asked.crank_angle, key, self._answer)
        self._traced = asked.values
        self._trace.ask(request, asked.crank_angle)

    def _take_branch(self, wish: Wish, answer: Any) -> None:
        self._refusals["branch"] = answer.message
        self.branch = self.questions.branch(wish.request, answer) if answer.success else None
        if self.branch is None:
            # Another position may have one.
            self._traced = None
            return
        track = self.branch.track
        self._place = track.place_of(wish.about)
        self._forward = True
        # From there it goes on to where the crank is by now, in the full turns of the track.
        turns = round((track.crank_angle(self._place) - wish.about) / math.tau)
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
