"""Goals, cancels and newer commands in any order, and whether each goal ends as it has to.

Only one thing ends a goal at a time, so that it is known how it has to end: what was sent on
several topics and services may arrive in any order.
"""

import random
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from testing.client import LATCHED
from testing.goals import GoalClient, SentGoal
from testing.machine import Machine
from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.motion.engine import GoalCode
from tri_glide_kinematics.vectors import Vector3

TOLERANCE = 0.0005  # m, position_tolerance by default
PART_OF_PATHS = 0.3
LONGEST_DELAY = 0.15  # s, about what a motion takes here
LONGEST_SILENCE = 10.0  # s, from the state to the result on a busy computer
BURST = 5
# What is sent while the machine is not ready for it is sent again, for this long [s].
PATIENCE = 60.0

SUCCEEDED, CANCELED, SUPERSEDED = GoalCode.SUCCEEDED, GoalCode.CANCELED, GoalCode.SUPERSEDED


@dataclass
class StormReport:
    """What came of a storm.

    Attributes:
        goals: how many were sent.
        codes: how many ended in which way.
        wrong: goals that ended in a way that they must not, in words.
        ends: when something ended a goal, and when its result came, by what that was [s].
    """

    goals: int = 0
    codes: Counter[GoalCode] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    ends: dict[str, list[tuple[float, float]]] = field(default_factory=dict)

    def largest_delays(self, part: float = 0.0) -> dict[str, float]:
        """Return the largest delay of each kind, after the largest ``part`` is left out [s]."""
        return {
            kind: sorted(end - begin for begin, end in ends)[
                max(int((1.0 - part) * len(ends)) - 1, 0)
            ]
            for kind, ends in self.ends.items()
        }


class GoalStorm:
    """Sends goals to a machine that is idle, and ends them."""

    def __init__(self, machine: Machine, goals: GoalClient, seed: int) -> None:
        """Send them by ``goals`` to ``machine``, in an order that depends on ``seed``."""
        self.report = StormReport()
        self._machine = machine
        self._client = machine.client
        self._goals = goals
        self._source = random.Random(seed)
        self._sent: list[SentGoal] = []
        # When the state said that the newest target is reached; None while it does not say so [s].
        self._arrival: float | None = None
        self._told: tuple[float, ...] = ()
        self._subscription = self._client.node.create_subscription(
            MachineState, f"{machine.namespace}/ik_node/machine_state", self._on_state, LATCHED
        )

    def run(self, count: int) -> StormReport:
        """Send ``count`` goals or a few more, and report; to be called once."""
        try:
            self._send_all(count)
        finally:
            # The storms that follow would be slower.
            self._client.node.destroy_subscription(self._subscription)
        # Nothing comes twice, or late.
        self._client.spin_for(0.2)
        for goal in self._sent:
            if goal.responses != 1:
                self.report.wrong.append(f"{goal.responses} results")
        return self.report

    def _send_all(self, count: int) -> None:
        steps: list[Callable[[], None]] = [
            self._reach,
            self._cancel,
            self._cancel,
            self._pose,
            self._twist,
            self._goal,
            self._burst,
            self._burst,
            self._refusal,
            self._stop,
            self._disable,
        ]
        while self.report.goals < count:
            self._source.choice(steps)()

    def _on_state(self, message: MachineState) -> None:
        # Between two arrivals a message may be lost, as the topic keeps the newest one only.
        target = message.target
        told = (message.state, message.cause, target.x, target.y, target.z)
        if told != self._told:
            self._told = told
            self._arrival = time.monotonic() if message.target_reached else None

    def _place(self) -> Vector3:
        x, y = (self._source.uniform(-0.03, 0.03) for _ in "xy")
        return (x, y, self._source.uniform(0.24, 0.3))

    def _send(self, is_path: bool | None = None) -> tuple[SentGoal, Vector3]:
        """Send a goal, a path or not; return it and the place where it leads to."""
        place = self._place()
        if self._is_path() if is_path is None else is_path:
            goal = self._goals.follow([self._place(), self._place(), place])
        else:
            goal = self._goals.move_to(place)
        self._sent.append(goal)
        self.report.goals += 1
        return goal, place

    def _is_path(self) -> bool:
        return self._source.random() < PART_OF_PATHS

    def _under_way(self) -> SentGoal:
        """Return a goal that was accepted some time ago, and may have ended."""
        goal, _ = self._send()
        goal.wait_until_accepted()
        if self._source.random() < 0.8:
            self._client.spin_for(self._source.uniform(0.0, LONGEST_DELAY))
        return goal

    def _ends(
        self,
        goal: SentGoal,
        allowed: tuple[GoalCode, ...],
        text: str,
        event: str,
        begin: float | None = None,
    ) -> None:
        """Check how a goal ends, which was asked for at ``begin``, by default just now."""
        had_ended = begin is None and goal.response is not None
        begin = begin or time.monotonic()
        result = goal.result()
        code = GoalCode(result.code)
        self.report.codes[code] += 1
        # Before it is asked for, no result can come.
        begin = max(begin, goal.asked)
        if code is allowed[0]:
            if text not in result.text:
                self.report.wrong.append(f"{event}: {result.text}")
            if not had_ended:
                self.report.ends.setdefault(event, []).append((begin, goal.ended))
        elif code not in allowed:
            self.report.wrong.append(f"{event}: {code.name}, {result.text}")

    def _reaches(self, goal: SentGoal, place: Vector3) -> None:
        result = goal.result()
        self.report.codes[GoalCode(result.code)] += 1
        at = (result.position.x, result.position.y, result.position.z)
        # It may have moved by the tolerance while it settled.
        if result.code != SUCCEEDED or max(map(abs, _minus(at, place))) > TOLERANCE:
            self.report.wrong.append(f"not reached: {result}")
        else:
            self._client.wait_for(lambda: self._arrival is not None, "the state")
            assert self._arrival is not None
            if goal.ended > self._arrival + LONGEST_SILENCE:
                self.report.wrong.append("the result came long after the state")
            self.report.ends.setdefault("arrival", []).append((self._arrival, goal.ended))

    def _reach(self) -> None:
        self._reaches(*self._send())

    def _cancel(self) -> None:
        goal = self._under_way()
        future = goal.cancel_without_waiting()
        self._ends(goal, (CANCELED, SUCCEEDED), "cancelled", "cancel, to rest")
        self._client.wait_for(future.done, "an answer")
        if len(future.result().goals_canceling) != (goal.response.result.code == CANCELED):
            self.report.wrong.append(f"cancel answered with {future.result()}")

    def _pose(self) -> None:
        goal = self._under_way()
        count = len(self._machine.states)
        self._client.send_pose(self._place())
        self._ends(goal, (SUPERSEDED, SUCCEEDED), "superseded by target", "pose")
        self._wait_until_taken(goal, "moving", count)

    def _twist(self) -> None:
        goal = self._under_way()
        count = len(self._machine.states)
        self._client.send_twist((0.0, 0.0, self._source.choice((-0.02, 0.02))))
        self._ends(goal, (SUPERSEDED, SUCCEEDED), "superseded by twist", "twist")
        self._wait_until_taken(goal, "jogging", count)

    def _goal(self) -> None:
        goal = self._under_way()
        newer = self._send()
        event = "goal"
        self._ends(goal, (SUPERSEDED, SUCCEEDED), "superseded by", event, newer[0].sent)
        self._reaches(*newer)

    def _burst(self) -> None:
        # The requests to one action come in the order in which they are sent.
        is_path = self._is_path()
        *others, last = burst = [self._send(is_path) for _ in range(BURST)]
        for (goal, _), (newer, _) in zip(others, burst[1:]):
            self._ends(goal, (SUPERSEDED,), "superseded by", "burst", newer.sent)
        if self._source.random() < 0.5:
            self._reaches(*last)
        else:
            last[0].wait_until_accepted().cancel_without_waiting()
            self._ends(last[0], (CANCELED, SUCCEEDED), "cancelled", "cancel, to rest")

    def _refusal(self) -> None:
        going = self._send()
        self._client.spin_for(self._source.uniform(0.0, 0.5 * LONGEST_DELAY))
        refused = self._goals.move_to((0.5, 0.0, 0.25))
        self._sent.append(refused)
        self.report.goals += 1
        self._ends(refused, (GoalCode.REFUSED,), "outside the workspace", "refusal")
        self._reaches(*going)

    def _stop(self) -> None:
        goal = self._under_way()
        self._client.stop()
        self._ends(goal, (GoalCode.STOPPED, SUCCEEDED), "stop was asked for", "stop")
        self._wait_for_idle()

    def _disable(self) -> None:
        goal = self._under_way()
        self._client.enable(False)
        self._ends(goal, (GoalCode.DISABLED, SUCCEEDED), "disabled by request", "disable")
        # While it ramps to a stop, it stays enabled.
        self._client.enable()
        self._wait_for_idle()

    def _wait_until_taken(self, goal: SentGoal, state: str, count: int) -> None:
        """Wait for a command that came after a ``goal`` had ended by itself.

        It is on another way than the next goal, and could overtake that.
        """
        if goal.response.result.code == SUCCEEDED:
            self._client.wait_for(
                lambda: state in self._machine.states_since(count), "a command to be taken"
            )

    def _wait_for_idle(self) -> None:
        """Wait until the machine takes goals again."""
        end = time.monotonic() + PATIENCE
        while True:
            place = self._place()
            goal = self._goals.move_to(place)
            if goal.result().code == SUCCEEDED:
                return
            if time.monotonic() > end:
                self.report.wrong.append(f"does not take goals again: {goal.result().text}")
                return


def _minus(first: Vector3, second: Vector3) -> Vector3:
    return (first[0] - second[0], first[1] - second[1], first[2] - second[2])
