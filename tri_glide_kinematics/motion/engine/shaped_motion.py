"""What the shaper makes of the plans that are held: the setpoints, and the proof of the next ones.

Plans are made, held and replaced as without a shaper; it is the mean of their platform positions
that is driven. So the past belongs to the motion as long as the shaper lasts, and a plan may only
replace the held one if what is driven then keeps all limits, from the first setpoint to rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tri_glide_kinematics.motion.shaped import DrivenPart, ShapedTrajectory

if TYPE_CHECKING:
    from tri_glide_kinematics.motion.limits import SampledPlan, SliderState
    from tri_glide_kinematics.motion.shaping import Shaper
    from tri_glide_kinematics.motion.trajectory import Trajectory
    from tri_glide_kinematics.tri_glide import TriGlide
    from tri_glide_kinematics.vectors import FloatArray


class ShapedMotion:
    """The shaped motion of the plans that are held one after the other.

    Attributes:
        time: since the newest of them is held [s].
    """

    def __init__(self, machine: TriGlide, shaper: Shaper, driven: Sequence[DrivenPart]) -> None:
        """Begin with what is ``driven``, seen from now."""
        self._machine = machine
        self._trajectory = ShapedTrajectory(machine, shaper, driven)
        self.time = 0.0

    @classmethod
    def from_rest(
        cls, machine: TriGlide, shaper: Shaper, plan: Trajectory, time: float
    ) -> ShapedMotion:
        """Return the motion of a ``plan`` that begins at rest, ``time`` seconds after its start."""
        return cls(machine, shaper, [DrivenPart(-time, plan, 0.0)])

    @property
    def shaper(self) -> Shaper:
        """Its impulses."""
        return self._trajectory.shaper

    def followed_by(self, plan: Trajectory, elapsed: float) -> ShapedMotion:
        """Return the motion that goes on with another ``plan``, of which some time is past [s]."""
        parts = self._with(plan, -elapsed)
        return ShapedMotion(self._machine, self.shaper, parts)

    def going_on(self, plan: Trajectory, lead: float) -> ShapedTrajectory:
        """Return the motion, from now on, if a ``plan`` takes over in ``lead`` seconds.

        If it is the plan that is held, that goes on as it is.
        """
        parts = self._driven
        if plan is not parts[-1].plan:
            parts = self._with(plan, lead)
        return ShapedTrajectory(self._machine, self.shaper, parts)

    @property
    def _driven(self) -> list[DrivenPart]:
        """All parts, seen from now."""
        return [part._replace(begin=part.begin - self.time) for part in self._trajectory.driven]

    def _with(self, plan: Trajectory, lead: float) -> list[DrivenPart]:
        """Return the parts that still count, seen from now, and another plan behind them."""
        parts = [part for part in self._driven if part.begin < lead]
        ends = [part.begin for part in parts[1:]]
        forgotten = sum(end < -self.shaper.duration for end in ends)
        return [*parts[forgotten:], DrivenPart(lead, plan, 0.0)]

    def at(self, time: float) -> SliderState:
        """Return the setpoint ``time`` seconds from now."""
        return self._trajectory.at(self.time + time)

    @property
    def place(self) -> float:
        """How far along the path of the newest plan the platform is, as the mean of places [m]."""
        return self._trajectory.place(self.time)

    @property
    def time_to_rest(self) -> float:
        """Time until the platform rests [s]."""
        return max(self._trajectory.duration - self.time, 0.0)

    def sample(self, times: FloatArray) -> SampledPlan:
        """Return the setpoints at ``times`` from now on. Shape (n,) [s]."""
        return self._trajectory.sample(self.time + times)._replace(times=times)
