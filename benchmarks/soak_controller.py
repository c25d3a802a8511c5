"""Adversarial soak of the controller: all that can arrive, at random, and its laws at each step.

Poses near and far, floods, twists, stops, enabling and disabling, limits, scale and shapers, and
faults of the measurement come in any order. At each step it is checked that

- the state is true: idle means at rest until the next command, with nothing that waits;
- a stop leads to rest, and says what it stopped;
- the stream never ends in motion, and keeps all limits by finite differences;
- the state that was told is the state;
- no plan is made twice for one command, and in a flood one for each turn.

Run it as ``python -m benchmarks.soak_controller --steps 1000000``; it exits with 1 after a
violation.
"""

import math
import sys
from collections.abc import Callable

import numpy as np

from benchmarks.judge import SCENARIOS, Findings, Judge, Scenario
from benchmarks.soak import (
    RandomActions,
    name_of,
    random_path,
    random_pauses,
    random_place,
    random_shaper,
    soak_all,
    some_pieces,
)
from tri_glide_kinematics.control import (
    DISABLED,
    FAULT,
    IDLE,
    IN_MOTION,
    WAITING,
    ControllerStatus,
    InPositionBounds,
    MotionController,
    Streams,
    SupervisionBounds,
    Supervisor,
)
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion import MotionEngine, MotionPhase, PlatformPath, SliderState
from tri_glide_kinematics.motion.engine import Follow
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace

TWIST_TIMEOUT = 0.1  # s
TARGET_TIMEOUT = 0.2  # s
MEASURED_TIMEOUT = 0.05  # s
LONGEST_STOP = 3.0  # s, for the slowest limits that are given here
JOINTS = ("slider_1", "slider_2", "slider_3")
BATCH = 20_000  # steps between two checks of the limits

# Plans that an action may need, where it is not one. A target that is tracked: until the first step
# of that a braking is held. Limits may brake, be in force, and lead on.
PLANS = {"track": 2, "track_onwards": 2, "set_limits": 2, "restore_limits": 2, "set_shaper": 0}
# They are answered at once.
SERVICES = ("pause", "resume", "stop", "disable", "enable")


class Adversary:
    """A controller with a machine, commanded at random, and the laws that it has to keep."""

    def __init__(self, scenario: Scenario, rng: np.random.Generator, findings: Findings) -> None:
        """Prepare a machine of the ``scenario``."""
        self._scenario = scenario
        self._name = f"scenario {SCENARIOS.index(scenario)}"
        self._rng = rng
        self._findings = findings
        self._workspace = Workspace(TriGlide(scenario.geometry), scenario.workspace)
        self.engine = MotionEngine(
            self._workspace, scenario.limits, kind=scenario.kind, in_pieces=scenario.in_pieces
        )
        self._statuses: list[ControllerStatus] = []
        limits = scenario.workspace
        self.controller = MotionController(
            self.engine,
            Supervisor(SupervisionBounds(MEASURED_TIMEOUT, 0.02, 0.05, (9.0,) * 3), JOINTS),
            period=scenario.dt,
            streams=Streams.with_timeouts(TWIST_TIMEOUT, TARGET_TIMEOUT),
            in_position_bounds=InPositionBounds(0.0005, 0.01, 0.1, 0.005),
            start_disabled=False,
            travel=(limits.lower_heights, limits.upper_heights),
            on_change=self._note_status,
            on_refusal=self._count_refusal,
        )
        self._now = 1000.0
        self._heights: Vector3 = self._workspace.check_position(random_place(rng, self._workspace))
        self._offset = 0.0
        self._silent_until = 0.0
        self._last: SliderState | None = None
        self._stopped_at = math.inf
        self._twist = np.zeros(3)
        self._target, self._target_velocity, self._seen = np.zeros(3), np.zeros(3), 0.0
        self._allowed_plans = 1
        self._services = 0
        self._restarted = False
        self._acted = True
        self._was_idle = False
        self._begins = False
        self._was_planning = False
        self._plan_number = self.engine.plan_number
        actions: tuple[tuple[float, Callable[[], object]], ...] = (
            (0.22, self._move),
            (0.10, self._move_nearby),
            (0.14, self._jog),
            (0.10, self._jog_again),
            (0.04, self._release),
            (0.12, self._track),
            (0.20, self._track_onwards),
            (0.12, self._follow),
            (0.06, self._append),
            (0.06, self.controller.pause),
            (0.06, self.controller.resume),
            (0.08, self._stop),
            (0.03, self._disable),
            (0.05, self._enable),
            (0.06, self._set_limits),
            (0.03, self._restore_limits),
            (0.05, self._set_shaper),
            (0.01, self._fall_silent),
            (0.01, self._jump),
        )
        self._random_actions = RandomActions(actions, rng, findings)

    def act(self) -> None:
        """Do something; a machine that is not led is moved by hand, and mostly enabled again."""
        self._acted = True
        if self._last is None and self._rng.random() < 0.3:
            place = random_place(self._rng, self._workspace)
            self._heights = self._workspace.check_position(place)
        if self.controller.state in (FAULT, DISABLED) and self._rng.random() < 0.4:
            action: Callable[[], object] = self._enable
        else:
            action = self._random_actions.drawn()
        name = name_of(action)
        self._allowed_plans += PLANS.get(name, 1)
        self._services += name in SERVICES
        self._random_actions.attempt(action)

    def step(self) -> tuple[Vector3, bool]:
        """Advance by one cycle; return the commanded heights and whether the stream goes on."""
        controller = self.controller
        self._now += self._scenario.dt
        before = self._last
        # A command may wait for some cycles, as one that came in with it had its turn first.
        waiting = controller._queue.target is not None
        self._was_planning = waiting or self.engine.preparing
        setpoint = controller.cycle(self._now, some_pieces(self._rng))
        if setpoint is None and before is not None and any(before.velocities):
            self._violated("the stream ended in motion")
        self._check_state(setpoint)
        self._begins = setpoint is not None and before is None
        goes_on = setpoint is not None and before is not None and not self._restarted
        self._restarted = False
        self._last = setpoint
        if setpoint is not None:
            self._heights = setpoint.heights
        if self._now >= self._silent_until:
            h1, h2, h3 = self._heights
            try:
                controller.measured((h1 + self._offset, h2, h3), self._now)
            except KinematicsError as error:
                self._findings.refused(error)
        self._offset *= 0.9
        return self._heights, goes_on

    def plan(self) -> None:
        """Let the controller use what is left of the cycle."""
        self.controller.plan(some_pieces(self._rng))
        self._check_state(self._last)
        self._check_plans()

    def _check_state(self, setpoint: SliderState | None) -> None:
        status = self.controller.status
        told = self._statuses[-1]
        if (told.state, told.reason) != (status.state, status.reason):
            self._violated(f"{told.state} was told, but it is {status.state}")
        self._allowed_plans += len(self._statuses) - 1
        del self._statuses[:-1]
        resting = self.engine.phase is MotionPhase.IDLE
        if status.state is IDLE and not resting:
            self._violated(f"idle, but the engine is {self.engine.phase}")
        if status.state is IDLE and setpoint is not None and any(setpoint.velocities):
            self._violated("idle in motion")
        leads = status.state not in (WAITING, DISABLED)
        if not leads and setpoint is not None and any(setpoint.velocities):
            self._violated(f"in motion while {status.state.value}")
        if not resting and status.state not in (*IN_MOTION, FAULT):
            self._violated(f"in motion while {status.state.value}")
        if resting or status.state in (IDLE, DISABLED):
            self._stopped_at = math.inf
        if self._now - self._stopped_at > LONGEST_STOP:
            self._violated(f"a stop did not lead to rest, it is {status.state.value}")

    def _check_plans(self) -> None:
        """Check that each plan was asked for: by a command, or by a change of state."""
        made = self.engine.plan_number - self._plan_number
        self._plan_number = self.engine.plan_number
        self._findings.plans += made
        was_idle, self._was_idle = self._was_idle, self.controller.state is IDLE
        if was_idle and made and not (self._acted or self._was_planning):
            self._violated("idle, and then a motion that nobody asked for")
        # What came before the first setpoint has its turn after it.
        self._acted = self._begins
        # Two commands had their turn since the last step: limits, which may need a plan to brake
        # and one to go on, and a target. Services are answered at once.
        if made > 3 + self._services:
            self._violated(f"{made} plans in one cycle")
        self._services = 0
        if self.engine.driven_path is not None:
            # A path is planned part by part, and braked for and gone to.
            self._allowed_plans += made
        self._allowed_plans -= made
        if self._allowed_plans < 0:
            self._violated("a plan that nobody asked for")
            self._allowed_plans = 0

    def _violated(self, text: str) -> None:
        self._findings.violated(f"{text} at {self._now:.4f} s of {self._name}")

    def _note_status(self, status: ControllerStatus) -> None:
        self._statuses.append(status)
        self._findings.told(status)

    def _count_refusal(self, _text: str, _refusal: Refusal) -> None:
        self._findings.refusals["when it was its turn"] += 1

    def _move(self) -> None:
        place = random_place(self._rng, self._workspace)
        self.controller.move_to(place)

    def _move_nearby(self) -> None:
        here = np.array(self._workspace.machine.forward(self._heights))
        x, y, z = (here + 10.0 ** self._rng.uniform(-9.0, -2.0) * self._rng.normal(size=3)).tolist()
        self.controller.move_to((x, y, z))

    def _jog(self) -> None:
        speed = 10.0 ** self._rng.uniform(-9.0, 0.0)
        direction = self._rng.normal(size=3)
        self._twist = direction / np.linalg.norm(direction) * speed
        self._jog_again()

    def _jog_again(self) -> None:
        x, y, z = self._twist.tolist()
        self.controller.jog((x, y, z), self._now)

    def _track(self) -> None:
        """Follow a target that may have jumped, and move anyhow."""
        self._target = np.array(random_place(self._rng, self._workspace))
        self._target_velocity = 10.0 ** self._rng.uniform(-3.0, 0.0) * self._rng.normal(size=3)
        self._seen = self._now
        self._track_onwards()

    def _track_onwards(self) -> None:
        self._target = self._target + (self._now - self._seen) * self._target_velocity
        self._seen = self._now
        x, y, z = self._target.tolist()
        dx, dy, dz = self._target_velocity.tolist()
        seen = self._now + float(self._rng.uniform(-0.05, 0.01))
        self.controller.track((x, y, z), (dx, dy, dz), seen, self._now)

    def _follow(self) -> None:
        self._follow_along(extends=False)

    def _append(self) -> None:
        self._follow_along(extends=True)

    def _follow_along(self, *, extends: bool) -> None:
        """Follow a path from the present place, or from the end of the one that is followed."""
        here = self._workspace.machine.forward(self._heights)
        size = 10.0 ** self._rng.uniform(-4.0, -1.5)
        rng = np.random.default_rng(self._rng.integers(2**32))

        def make(end: Vector3 | None) -> Interruptible[PlatformPath]:
            yield
            return random_path(rng, end or here, size)

        self.controller.pursue(Follow.made(make, "path", extends))

    def _release(self) -> None:
        self.controller.jog((0.0, 0.0, 0.0), self._now)

    def _stop(self) -> None:
        before = self.controller.status
        answer = self.controller.stop()
        if before.state in IN_MOTION and before.reason.text not in answer:
            self._violated(f"stop answered {answer!r}, but it was {before.reason.text!r}")
        if self.engine.phase is not MotionPhase.IDLE:
            if "ramping to a stop" not in answer:
                self._violated(f"stop answered {answer!r} in motion")
            self._stopped_at = min(self._stopped_at, self._now)

    def _disable(self) -> None:
        self.controller.disable()
        if self.engine.phase is not MotionPhase.IDLE:
            self._stopped_at = min(self._stopped_at, self._now)

    def _enable(self) -> None:
        answer = self.controller.enable(self._now)
        self._restarted = self._restarted or answer == "enabled"

    def _set_limits(self) -> None:
        factors = 10.0 ** self._rng.uniform(-0.7, 0.0, size=(3, 3))
        limits = self._scenario.limits
        limits = limits.with_table(limits.table * factors)
        self.controller.set_limits(limits, 10.0 ** float(self._rng.uniform(-2.0, 0.0)))

    def _restore_limits(self) -> None:
        self.controller.set_limits(self._scenario.limits, 1.0)

    def _set_shaper(self) -> None:
        self.engine.set_shaper(random_shaper(self._rng))

    def _fall_silent(self) -> None:
        self._silent_until = self._now + float(self._rng.uniform(0.0, 3.0 * MEASURED_TIMEOUT))

    def _jump(self) -> None:
        self._offset = float(self._rng.choice((0.001, 0.01, 0.1)))


def soak(scenario: Scenario, steps: int, seed: int, findings: Findings) -> None:
    """Drive a controller for a number of ``steps`` and check all of them."""
    rng = np.random.default_rng(seed)
    adversary = Adversary(scenario, rng, findings)
    # A machine whose encoders have jumped is enabled wherever they say it is.
    judge = Judge(scenario, findings, starts_inside=False)
    done = streak = 0
    while done < steps:
        count = min(BATCH, steps - done)
        heights, bounds = np.empty((count, 3)), np.empty((count, 3, 3))
        streaks = np.empty(count, dtype=np.int64)
        pauses = iter(random_pauses(rng, count))
        pause = next(pauses)
        for row in range(count):
            pause -= 1
            while pause <= 0:
                pause = next(pauses)
                for _ in range(int(rng.integers(1, 4))):
                    adversary.act()
            heights[row], goes_on = adversary.step()
            streak = streak + 1 if goes_on else 0
            streaks[row] = streak
            engine = adversary.engine
            bounds[row] = engine.limits.with_velocity_scaled(engine.speed_scale).table
            adversary.plan()
        judge.add(heights, bounds, streaks)
        done += count


def main() -> int:
    """Soak all scenarios and print what was found."""
    findings = soak_all(soak, __doc__, 1_000_000)
    print(f"largest parts of the limits: {findings.peaks}")
    return 1 if findings.violations else 0


if __name__ == "__main__":
    sys.exit(main())
