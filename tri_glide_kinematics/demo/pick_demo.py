"""The command ``pick_demo``: parts are picked from a simulated belt that moves, and placed.

Where the platform and the part truly were when the gripper closed, which no real cell knows, tells
how far they were apart.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from rclpy.action import ActionClient

from tri_glide_interfaces.action import Pick
from tri_glide_interfaces.msg import PartEvent, PickState
from tri_glide_kinematics.demo.client import (
    DEEP_QUEUE,
    MOVE_TIMEOUT,
    DemoError,
    DemoNode,
    running_nodes,
    seconds,
)
from tri_glide_kinematics.demo.running import run_demo, save_page, say
from tri_glide_kinematics.picking import PartOutcome
from tri_glide_kinematics.ros.goal_sender import SentGoal
from tri_glide_kinematics.ros.messages import vector_of
from tri_glide_kinematics.ros.outputs import LATCHED
from tri_glide_kinematics.vectors import FloatArray, Vector3

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Parts are gripped and placed at this height, and carried at the other one [m].
LOW, HIGH = 0.25, 0.275
PLACE: Vector3 = (0.0, -0.1, LOW)
WINDOW, VIEW, WIDTH = (-0.1, 0.1), (-0.3, -0.15), 0.06
# Of the belt, if it is not told [m/s], and from part to part [m].
SPEED, DISTANCE = 0.1, 0.12
# Setpoints a second: fewer than by default, as a busy computer has to serve both machine and cell.
RATE = 250.0
# With which the simulated sliders follow; each setpoint is the newest one for a period [s].
LAG = 0.005
DELAY = LAG + 0.5 / RATE
# Of the gripper; the node is told a little more [s].
GRIPPER, MARGIN = 0.02, 0.005
# A busy computer is late: so far from a part it is taken all the same [m].
REACH = 0.006
# How long a part may take [s].
PATIENCE = 60.0
# So often is a run asked for until the node hears the machine.
MOST_GOALS = 100

CELL = {
    "first_part": [VIEW[0], 0.0, LOW],
    "part_distance": DISTANCE,
    "part_width": WIDTH,
    "camera_view": list(VIEW),
    "gripper_delay": GRIPPER,
    "gripper_reach": REACH,
}
PICKS = {
    "window": list(WINDOW),
    "height": HIGH,
    "first_place": list(PLACE),
    "closing_time": GRIPPER + MARGIN,
    "opening_time": GRIPPER + MARGIN,
    "has_sensor": True,
    "sensing_time": 0.1,
    "belt_timeout": 0.5,
    "allowed_error": REACH,
    "drive_delay": DELAY,
}


@dataclass(eq=False)
class Record:
    """What was seen of a run.

    Attributes:
        speed: of the belt [m/s].
        places: times, and where the platform truly was [s, m].
        grips: times, and how far the gripper's point was off the nearest part [s, m].
        events: what has become of parts.
    """

    speed: float
    places: list[tuple[float, Vector3]] = field(default_factory=list)
    grips: list[tuple[float, Vector3]] = field(default_factory=list)
    events: list[PartEvent] = field(default_factory=list)

    def error(self, event: PartEvent) -> float:
        """Return how far the gripper truly was off a part when it closed; NaN if it did not [m]."""
        near = [off for time, off in self.grips if abs(time - seconds(event.gripped)) < 0.1]
        return math.hypot(*near[0]) if near else math.nan

    @property
    def rate(self) -> float:
        """Cycles a minute, from the first part that was placed to the last one."""
        placed = [seconds(event.placed) for event in self.events if event.placed.sec]
        return 60.0 * (len(placed) - 1) / (placed[-1] - placed[0]) if len(placed) > 1 else math.nan

    def place_at(self, time: float) -> Vector3:
        """Return where the platform truly was at a time [s]. Shape (3,) [m]."""
        return min(self.places, key=lambda each: abs(each[0] - time))[1]


class PickClient(DemoNode):
    """Starts a run, and listens to what becomes of the parts."""

    def __init__(self, speed: float) -> None:
        """Join the machine of this demonstration, beside a belt with a ``speed`` [m/s]."""
        super().__init__("tri_glide_pick_demo")
        self.record = Record(speed)
        self._seen = 0
        self.create_subscription(PoseStamped, "true_pose", self._on_pose, DEEP_QUEUE)
        self.calls.create_subscription(Vector3Stamped, "true_grip_errors", self._on_grip, 10)
        self.calls.create_subscription(PartEvent, "pick_node/part_events", self._on_event, 10)
        self.calls.create_subscription(PickState, "pick_node/pick_state", self._on_parts, LATCHED)
        self._runs = ActionClient(self.calls, Pick, "pick_node/run")

    def pick(self, count: int) -> SentGoal:
        """Have so many parts placed, and return the goal that has ended."""
        self.wait_for_machine(lambda: self._runs.server_is_ready() and self._seen)
        goals: list[SentGoal] = []

        def is_over() -> bool:
            # At first the node may not have heard of the machine.
            if not goals or (_is_refused(goals[-1]) and len(goals) < MOST_GOALS):
                goals.append(SentGoal(self._runs, Pick.Goal(count=count)))
            return goals[-1].result is not None

        self.wait_for(is_over, MOVE_TIMEOUT + PATIENCE * count, "picking parts")
        return goals[-1]

    def _on_pose(self, message: PoseStamped) -> None:
        self.record.places.append((seconds(message.header.stamp), vector_of(message.pose.position)))

    def _on_grip(self, message: Vector3Stamped) -> None:
        self.record.grips.append((seconds(message.header.stamp), vector_of(message.vector)))

    def _on_event(self, message: PartEvent) -> None:
        self.record.events.append(message)
        off = 1e3 * self.record.error(message)
        text = "" if math.isnan(off) else f", {off:.2f} mm off at the grip"
        say(f"part {message.part}: {message.text}{text}")

    def _on_parts(self, message: PickState) -> None:
        self._seen = len(message.parts)


def _is_refused(goal: SentGoal) -> bool:
    return goal.result is not None and goal.result.code == Pick.Result.REFUSED


def counts(record: Record) -> str:
    """Return how many parts ended how, in words."""
    found = [event.outcome for event in record.events]
    return ", ".join(f"{found.count(each)} {each.name.lower()}" for each in PartOutcome)


def pick_figure(record: Record) -> Figure:
    """Return a page with the way of the platform, and what became of the parts."""
    # Drawing is imported late: it takes as long as starting the nodes.
    from matplotlib.figure import Figure

    way = np.array([place for _, place in record.places])
    gripped = [event for event in record.events if event.gripped.sec]
    grips = np.array([record.place_at(time) for time, _ in record.grips])
    figure = Figure(figsize=(13.0, 7.5), layout="constrained")
    grid = figure.add_gridspec(2, 2)
    above = figure.add_subplot(grid[0, 0])
    above.axhspan(-500.0 * WIDTH, 500.0 * WIDTH, color="0.9", label="belt, which runs to the right")
    above.axvspan(*(1e3 * end for end in VIEW), color="tab:blue", alpha=0.15, label="camera")
    _draw_way(above, way, grips, 1)
    above.legend(fontsize=8, loc="lower left")
    above.set(title="from above", ylabel="y [mm]", aspect="equal")
    side = figure.add_subplot(grid[0, 1])
    side.axhline(1e3 * LOW, color="0.8")
    _draw_way(side, way, grips, 2)
    side.set(title="from the side (z is stretched)", ylabel="z [mm]")
    _draw_outcomes(figure.add_subplot(grid[1, 0]), record.events)
    errors = figure.add_subplot(grid[1, 1])
    off = [1e3 * record.error(event) for event in gripped]
    errors.bar([str(event.part) for event in gripped], off, color="tab:orange")
    errors.set(title="how far the gripper truly was off its part", xlabel="part", ylabel="mm")
    speed, rate = record.speed, record.rate
    figure.suptitle(f"Parts picked from a belt at {speed:g} m/s: {rate:.0f} cycles a minute")
    return figure


def _draw_way(axes: Axes, way: FloatArray, grips: FloatArray, axis: int) -> None:
    """Draw places of the platform, shape (n, 3) [m], by x and another axis."""
    axes.plot(1e3 * way[:, 0], 1e3 * way[:, axis], linewidth=0.8, label="platform")
    if len(grips):
        axes.plot(1e3 * grips[:, 0], 1e3 * grips[:, axis], "o", color="tab:orange", label="grips")
    axes.plot(1e3 * PLACE[0], 1e3 * PLACE[axis], "s", color="tab:green", label="place")
    axes.set_xlabel("x [mm]")
    axes.grid(alpha=0.3)


def _draw_outcomes(axes: Axes, events: Sequence[PartEvent]) -> None:
    """Draw each part from when it was seen to its outcome."""
    colours = dict(zip(PartOutcome, ("tab:green", "tab:red", "tab:purple", "tab:gray")))
    begin = min(seconds(event.seen) for event in events)
    for event in events:
        outcome = PartOutcome(event.outcome)
        seen, ended = (seconds(stamp) - begin for stamp in (event.seen, event.header.stamp))
        axes.plot([seen, ended], [event.part] * 2, color=colours[outcome])
        axes.plot(ended, event.part, "o", color=colours[outcome])
        if event.gripped.sec:
            axes.plot(seconds(event.gripped) - begin, event.part, "|", color="black")
    for outcome, colour in colours.items():
        axes.plot([], [], "o", color=colour, label=outcome.name.lower())
    axes.legend(fontsize=8)
    axes.set(title="each part from its first view on (|: gripped)", xlabel="s", ylabel="part")
    axes.grid(alpha=0.3)


def demonstrate(output: Path, count: int, speed: float) -> int:
    """Start the nodes, pick, and return the exit code."""
    say(f"starting a machine beside a belt at {speed:g} m/s")
    nodes: dict[str, Mapping[str, object]] = {
        "simulator_node": {"lag": LAG},
        "ik_node": {"drive_delay": DELAY, "rate": RATE},
        "simulated_cell_node": {**CELL, "belt_speeds": [0.0, speed, 1.0]},
        "pick_node": PICKS,
    }
    with running_nodes(nodes):
        client = PickClient(speed)
        goal, record = client.pick(count), client.record
    if not record.events:
        raise DemoError(goal.result.text)
    say(f"{counts(record)}; {record.rate:.1f} cycles a minute")
    off = [error for event in record.events if not math.isnan(error := record.error(event))]
    if off:
        say(
            f"off at the grip: {1e3 * np.mean(off):.2f} mm on average, {1e3 * max(off):.2f} at most"
        )
    save_page(output, "pick_demo", pick_figure(record))
    if not goal.has_succeeded:
        say(f"FAILED: {goal.result.text}")
    return 0 if goal.has_succeeded else 1


def main() -> int:
    """Run the demonstration from the command line."""
    return run_demo(
        "pick_demo",
        __doc__,
        demonstrate,
        count={"type": int, "default": 12, "help": "parts to be placed (default: 12)"},
        speed={"type": float, "default": SPEED, "help": f"of the belt [m/s] (default: {SPEED:g})"},
    )


if __name__ == "__main__":
    sys.exit(main())
