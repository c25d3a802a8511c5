"""One step of tracking and the braking behind it: a plan to rest, of which little is looked at."""

from __future__ import annotations

from collections.abc import Sequence

from tri_glide_kinematics.motion.trajectory.cubic import CubicPlan, SampledPlan, SliderState
from tri_glide_kinematics.motion.trajectory.phases import Phases
from tri_glide_kinematics.vectors import FloatArray


class TrackedStep:
    """A certified plan: one step, then a braking to rest.

    As a rule the next cycle replaces the plan after its step. So only the state after the step is
    at hand; all of the plan is worked out when something else is asked for.

    Attributes:
        start: state in which the step begins.
        after: state after the step.
        period: of the step [s].
        duration: time from the start until all sliders rest [s].
    """

    __slots__ = ("_cubic", "_ways", "after", "duration", "period", "start")

    def __init__(
        self,
        start: SliderState,
        after: SliderState,
        period: float,
        ways: Sequence[Phases],
        duration: float,
    ) -> None:
        """Store what was certified.

        Args:
            start: state in which the step begins.
            after: state after the step.
            period: of the step [s].
            ways: phases of each slider, of the step and of the braking.
            duration: of the longest way [s].
        """
        self.start = start
        self.after = after
        self.period = period
        self.duration = duration
        self._ways = ways
        self._cubic: CubicPlan | None = None

    @property
    def ends_at_rest(self) -> bool:
        """Whether nothing moves after the step."""
        return self.duration <= self.period and not any(
            (*self.after.velocities, *self.after.accelerations)
        )

    def as_cubic(self) -> CubicPlan:
        """Return all of the plan in pieces of constant jerk."""
        if self._cubic is None:
            self._cubic = CubicPlan(self.start, self._ways)
        return self._cubic

    def state(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds after the start; after the end, that of the end."""
        if time == self.period:
            return self.after
        return self.as_cubic().state(time) if time > 0.0 else self.start

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at many ``times``. Shape (n,) [s]."""
        return self.as_cubic().sample(times)
