"""What the shaper makes of the plans that are held: the setpoints, and the proof of the next ones.

Plans are made, held and replaced as without a shaper; it is the mean of their platform positions
that is driven. So the past belongs to the motion as long as the shaper lasts, and a plan may only
replace the held one if what is driven then keeps all limits, from the first setpoint to rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tri_glide_kinematics.motion.trajectory import DrivenPart, ShapedTrajectory

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.shaping import Shaper
    from tri_glide_kinematics.motion.trajectory import SampledPlan, SliderState, Trajectory
    from tri_glide_kinematics.tri_glide import TriGlide
    from tri_glide_kinematics.vectors import FloatArray


class ShapedMotion:
    """The shaped motion of the plans that are held one after the other."""

    def __init__(self, machine: TriGlide, shaper: Shaper, plan: Trajectory, time: float) -> None:
        """Begin at rest, at a ``time`` [s] in a ``plan``."""
        self._machine = machine
        self.shaper = shaper
        self._begin([DrivenPart(-time, plan, 0.0)])

    def _begin(self, driven: Sequence[DrivenPart]) -> None:
        self._trajectory = ShapedTrajectory(self._machine, self.shaper, driven)
        self._time = 0.0

    def advance(self, dt: float) -> None:
        """Let ``dt`` seconds pass."""
        self._time += dt

    def hold(self, plan: Trajectory, elapsed: float) -> None:
        """Go on with another ``plan``, of which ``elapsed`` seconds are past."""
        self._begin(self._with(plan, -elapsed))

    def going_on(self, plan: Trajectory, lead: float) -> ShapedTrajectory:
        """Return the motion, from now on, if a ``plan`` takes over in ``lead`` seconds."""
        return ShapedTrajectory(self._machine, self.shaper, self._with(plan, lead))

    def _with(self, plan: Trajectory, lead: float) -> list[DrivenPart]:
        """Return the parts that still count, seen from now, and another plan behind them."""
        parts = [part._replace(begin=part.begin - self._time) for part in self._trajectory.driven]
        parts = [part for part in parts if part.begin < lead]
        ends = [part.begin for part in parts[1:]]
        forgotten = sum(end < -self.shaper.duration for end in ends)
        return [*parts[forgotten:], DrivenPart(lead, plan, 0.0)]

    @property
    def state(self) -> SliderState:
        """Present setpoint."""
        return self._trajectory.at(self._time)

    @property
    def time_to_rest(self) -> float:
        """Time until the platform rests [s]."""
        return max(self._trajectory.duration - self._time, 0.0)

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at ``times`` from now on. Shape (n,) [s]."""
        return self._trajectory.sample(self._time + times)._replace(times=times)
