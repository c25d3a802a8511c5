"""The command ``calm_demo``: a simulated machine swings, without a shaper and with one.

A move, a path and a stop are driven twice. The true place of the platform, which no real machine
knows, tells how much it swings after its setpoints have come to rest, and for how long.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from geometry_msgs.msg import PoseStamped
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from tri_glide_interfaces.msg import MachineState
from tri_glide_kinematics.demo.client import (
    DEEP_QUEUE,
    MACHINE,
    MOVE_TIMEOUT,
    START_TIMEOUT,
    DemoError,
    DemoNode,
    running_nodes,
    seconds,
)
from tri_glide_kinematics.demo.running import run_demo, save_page, say
from tri_glide_kinematics.motion.path import FlatPath, SegmentKind
from tri_glide_kinematics.ros.messages import vector_of
from tri_glide_kinematics.vectors import FloatArray, Vector3

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FREQUENCY, DAMPING = 15.0, 0.03  # Hz, of the mode along each axis
PERIOD = 0.002  # s, of the setpoints
FINEST = 1e-7  # m; below, a distance is drawn as this
UNSHAPED = "none"
SHAPERS = (UNSHAPED, "ei")

# A short move, of which an unshaped mode keeps much; a path, at full speed; and a long line at one
# speed, so that it does not matter where on it the stop is heard.
NEAR = (-0.02, 0.0, 0.25), (0.02, 0.0, 0.25)
FAR = (-0.15, 0.0, 0.25), (0.15, 0.0, 0.25)
CORNER: Vector3 = (-0.04, -0.04, 0.25)
# From the corner on: along x, through a quarter of a circle, along y. A shaper cuts bends, so it
# needs a tolerance.
PATH = FlatPath.of(
    [SegmentKind.LINE, SegmentKind.ARC_ABOUT, SegmentKind.LINE],
    [
        *(0.02, -0.04, 0.25),
        *(0.02, -0.02, 0.25, 0.0, 0.0, 1.0, math.pi / 2.0),
        *(0.04, 0.04, 0.25),
    ],
    [0.001],
    [],
    0.0,
)
LINE_SPEED = 0.3  # m/s
LINE = FlatPath.of([SegmentKind.LINE], FAR[1], [0.0], [LINE_SPEED], 0.0)
# Along x: the line is stopped as soon as its setpoints are there [m].
STOP_AT = -0.1

CLOSE = 50e-6  # m from where it comes to rest: what counts as there
# All that is left of a swing when the next motion may begin, and what counts as moved [m].
FADED, MOVED = 1e-6, 3e-6
FADED_POSES = 100  # a period of the slowest mode there is, and more
# A shaper has to leave less than this part of a swing, unless that is within ``CLOSE`` anyway.
PART_LEFT = 0.1


@dataclass(frozen=True, eq=False)
class Swing:
    """How a platform came to rest.

    The time is that of the setpoints, so a busy computer changes nothing.

    Attributes:
        motion: in a word.
        shaper: that was set.
        times: from the start of the motion, or from the stop on. Shape (n,) [s].
        distances: of the platform from where it comes to rest. Shape (n,) [m].
        arrival: when the setpoints came to rest [s].
    """

    motion: str
    shaper: str
    times: FloatArray
    distances: FloatArray
    arrival: float

    @property
    def left(self) -> float:
        """Largest distance after the arrival [m]."""
        return float(self.distances[self.times >= self.arrival].max(initial=0.0))

    @property
    def settled(self) -> float:
        """Time from which on the platform is close for good [s]."""
        away = np.flatnonzero(self.distances > CLOSE)
        return float(self.times[min(away[-1] + 1, len(self.times) - 1)]) if len(away) else 0.0

    @classmethod
    def of(
        cls, motion: str, shaper: str, setpoints: FloatArray, places: FloatArray, since: int = 0
    ) -> Swing:
        """Return how the platform came to rest.

        Args:
            motion: in a word.
            shaper: that was set.
            setpoints: of the platform, from rest to rest, each period. Shape (m, 3) [m].
            places: of the platform, from rest to rest, each period. Shape (n, 3) [m].
            since: setpoint from which on the time counts, if that is later than the first one that
                moves.

        Raises:
            DemoError: if nothing moved.
        """
        commanded, true = (_moved(rows) for rows in (setpoints, places))
        begin = max(since, commanded[0])
        # The platform began to move with the setpoints: so the two are matched.
        first = true[0] + begin - commanded[0]
        rest = places[-FADED_POSES:].mean(axis=0)
        distances: FloatArray = np.linalg.norm(places[first:] - rest, axis=1)
        times: FloatArray = PERIOD * np.arange(len(distances), dtype=np.float64)
        arrival = np.flatnonzero(np.any(np.diff(setpoints, axis=0) != 0.0, axis=1))[-1] + 1
        return cls(motion, shaper, times, distances, PERIOD * float(arrival - begin))


def _moved(places: FloatArray) -> list[int]:
    """Return the indices of the places, shape (n, 3) [m], that are away from the first one."""
    away = np.linalg.norm(places - places[0], axis=1) > MOVED
    if not away.any():
        raise DemoError("the machine did not move")
    return [int(index) for index in np.flatnonzero(away)]


class CalmClient(DemoNode):
    """Commands motions, and records setpoints and where the platform truly is."""

    def __init__(self) -> None:
        """Join the machine of this demonstration."""
        super().__init__("tri_glide_calm_demo")
        self._heights: list[Vector3] = []
        self._places: list[Vector3] = []
        # Stamps of the newest setpoint and of the newest place [s].
        self._heard = {"setpoint": 0.0, "place": 0.0}
        self.create_subscription(JointState, "joint_commands", self._on_command, DEEP_QUEUE)
        self.create_subscription(PoseStamped, "true_pose", self._on_pose, DEEP_QUEUE)
        self._stop = self.calls.create_client(Trigger, "ik_node/stop")

    @property
    def hears(self) -> bool:
        """Whether setpoints and places come, and a stop is heard."""
        return bool(self._stop.service_is_ready() and self._heights and self._places)

    def set_shaper(self, shaper: str) -> None:
        """Have ``ik_node`` shape its motions for the mode of the machine, or not.

        Raises:
            DemoError: if it refuses.
        """
        values = {"shaper": shaper, "mode_frequencies": [FREQUENCY], "mode_dampings": [DAMPING]}
        answer = self.ik_parameters.set_parameters_atomically(
            [Parameter(name, value=value) for name, value in values.items()]
        )
        self.wait_for(answer.done, START_TIMEOUT, "setting the shaper")
        result = answer.result().result
        if not result.successful:
            raise DemoError(f"shaper {shaper}: {result.reason}")

    def follow_until_stopped(self, path: FlatPath) -> int:
        """Stop on a ``path``, and return at which of the setpoints."""
        goal = self.goals.follow(path)
        self.wait_for(
            lambda: MACHINE.forward(self._heights[-1])[0] >= STOP_AT, MOVE_TIMEOUT, "a motion"
        )
        number = len(self._heights)
        self._stop.call_async(Trigger.Request())
        self.wait_for(lambda: goal.result is not None, MOVE_TIMEOUT, "a stop")
        return number

    def recorded(self, motion: str, shaper: str, drive: Callable[[], int | None]) -> Swing:
        """Return how the platform comes to rest after ``drive``.

        This may return from which setpoint on the time counts.
        """
        self._wait_until_faded()
        del self._heights[:-1], self._places[:-1]
        since = drive()
        self._wait_until_faded()
        setpoints = MACHINE.forward_batch(np.array(self._heights))
        return Swing.of(motion, shaper, setpoints, np.array(self._places), since or 0)

    def _wait_until_faded(self) -> None:
        """Wait until the setpoints rest, and the platform, too."""
        # Recorded messages may have waited in a queue for longer than the end of a goal.
        now = seconds(self.get_clock().now().to_msg())
        self.wait_for(
            lambda: min(self._heard.values()) > now, MOVE_TIMEOUT, "listening to all setpoints"
        )
        count = len(self._places) + FADED_POSES

        def has_faded() -> bool:
            newest = np.array(self._places[-FADED_POSES:])
            return bool(
                len(self._places) > count
                and self.state == MachineState.IDLE
                and np.ptp(newest, axis=0).max() < FADED
            )

        self.wait_for(has_faded, MOVE_TIMEOUT, "coming to rest")

    def _on_command(self, message: JointState) -> None:
        h1, h2, h3 = message.position
        self._heights.append((h1, h2, h3))
        self._heard["setpoint"] = seconds(message.header.stamp)

    def _on_pose(self, message: PoseStamped) -> None:
        self._places.append(vector_of(message.pose.position))
        self._heard["place"] = seconds(message.header.stamp)


def drive(client: CalmClient, shapers: Sequence[str] = SHAPERS) -> list[Swing]:
    """Drive all motions with each of the ``shapers``."""
    swings = []
    client.wait_for_machine(lambda: client.hears)
    for shaper in shapers:
        motions: tuple[tuple[str, Vector3, Callable[[], int | None]], ...] = (
            ("move", NEAR[0], lambda: client.go_to(NEAR[1])),
            ("path", CORNER, lambda: client.follow(PATH)),
            ("stop", FAR[0], lambda: client.follow_until_stopped(LINE)),
        )
        for name, start, motion in motions:
            # On the way there it does not swing, so that nothing has to fade.
            client.set_shaper(shapers[-1])
            client.go_to(start)
            client.set_shaper(shaper)
            swing = client.recorded(name, shaper, motion)
            say(f"{name}, shaper {shaper}: {1e3 * swing.left:.3f} mm of swing are left")
            swings.append(swing)
    return swings


def table(swings: Sequence[Swing]) -> str:
    """Return one line for each motion."""
    heads = ("swing left [mm]", "setpoints at rest after [s]", "within 50 µm for good after [s]")
    lines = [f"{'motion':8}{'shaper':10}" + "".join(f"{head:>33}" for head in heads)]
    for swing in sorted(swings, key=lambda swing: swing.motion):
        numbers = (1e3 * swing.left, swing.arrival, swing.settled)
        cells = "".join(f"{number:33.3f}" for number in numbers)
        lines.append(f"{swing.motion:8}{swing.shaper:10}{cells}")
    return "\n".join(lines)


def is_calm(swings: Sequence[Swing]) -> bool:
    """Tell whether all shapers have taken the swing away, and are there sooner than without."""
    unshaped = {swing.motion: swing for swing in swings if swing.shaper == UNSHAPED}
    return all(
        swing.left <= max(PART_LEFT * unshaped[swing.motion].left, CLOSE)
        and swing.settled < unshaped[swing.motion].settled
        for swing in swings
        if swing.shaper != UNSHAPED
    )


def swing_figure(swings: Sequence[Swing], close: float) -> Figure:
    """Return a page with how the platform came to rest, and what counts as there [m]."""
    # Drawing is imported late: it takes as long as starting the nodes.
    from matplotlib.figure import Figure

    motions = list(dict.fromkeys(swing.motion for swing in swings))
    figure = Figure(figsize=(13.0, 5.0), layout="constrained")
    shared: Axes | None = None
    for number, motion in enumerate(motions, start=1):
        axes = figure.add_subplot(1, len(motions), number, sharey=shared)
        shared = shared or axes
        for swing in swings:
            if swing.motion == motion:
                heights = 1e3 * np.maximum(swing.distances, FINEST)
                (line,) = axes.plot(swing.times, heights, label=f"shaper {swing.shaper}")
                axes.axvline(swing.arrival, color=line.get_color(), linestyle=":")
        axes.axhline(1e3 * close, color="gray", linestyle="--")
        axes.set_yscale("log")
        axes.set(title=motion, xlabel="time [s]")
        axes.grid(alpha=0.3)
    if shared is not None:
        shared.set_ylabel("distance from where it comes to rest [mm]")
        shared.legend()
    figure.suptitle("Swing of the platform (dotted: its setpoints have come to rest)")
    return figure


def demonstrate(output: Path) -> int:
    """Start the nodes, drive, judge, and return the exit code."""
    rate = {"rate": 1.0 / PERIOD}
    swinging = {
        "swing_frequencies": [FREQUENCY] * 3,
        "swing_dampings": [DAMPING],
        "setpoint_period": PERIOD,
    }
    say(f"starting a machine that swings at {FREQUENCY:g} Hz, damping {DAMPING:g}")
    with running_nodes({"simulator_node": {**rate, **swinging}, "ik_node": rate}):
        swings = drive(CalmClient())
    print(f"\n{table(swings)}\n")
    save_page(output, "calm_demo", swing_figure(swings, CLOSE))
    good = is_calm(swings)
    say("calm, and sooner there" if good else "FAILED: see the table")
    return 0 if good else 1


def main() -> int:
    """Run the demonstration from the command line."""
    return run_demo("calm_demo", __doc__, demonstrate)


if __name__ == "__main__":
    sys.exit(main())
