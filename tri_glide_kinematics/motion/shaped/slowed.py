r"""A trajectory that is slowed down on its own way until it rests.

It is the braking that is nearly always at hand. After a time $t = uD$ the motion is where the other
one would be after $\tau$, with

$$\dot\tau = 1 - 3 u^2 + 2 u^3,\qquad \tau = D\,(u - u^3 + u^4 / 2).$$

So nothing gets faster: velocities, the speed of the platform and the places on the way are kept
because the other motion keeps them, whatever is at its limit there. Only accelerations, jerks and
forces remain to be proved, and where the other motion is steady they are as small as D makes them:

$$\dot h \dot\tau,\quad \ddot h \dot\tau^2 + \dot h \ddot\tau,\quad
h^{(3)} \dot\tau^3 + 3 \ddot h \dot\tau \ddot\tau + \dot h \tau^{(3)},\qquad
|\ddot\tau| \le \tfrac{3}{2D},\ |\tau^{(3)}| \le \tfrac{6}{D^2}.$$
"""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.limits import (
    SliderLimits,
    SliderState,
    composed,
    moved,
    polynomial,
)
from tri_glide_kinematics.motion.shaped.shaped import SeriesPlan
from tri_glide_kinematics.motion.trajectory import MixedSeries, Trajectory
from tri_glide_kinematics.tri_glide import TriGlide
from tri_glide_kinematics.vectors import FloatArray, Vector3, ascending
from tri_glide_kinematics.workspace import Workspace

# Steps of a bisection: then an instant is known to rounding.
_HALVINGS = 60


class SlowedPlan(SeriesPlan):
    """Another plan, from an instant of it on, slowed down to rest.

    Attributes:
        duration: time until it rests; of the other plan half of that is driven [s].
    """

    def __init__(self, machine: TriGlide, plan: Trajectory, begin: float, duration: float) -> None:
        """Slow down a ``plan`` of a ``machine`` from a time ``begin`` in it on [s]."""
        super().__init__(machine, duration)
        self._plan = plan
        self._begin = begin

    def at(self, time: float) -> SliderState:
        """Return the setpoint at a ``time`` [s]; outside, that of the start or of the end."""
        u = min(max(time / self.duration, 0.0), 1.0)
        # How much of the other plan is past, and how that changes.
        passed = self.duration * u * (1.0 - u * u * (1.0 - 0.5 * u))
        rate, bend = 1.0 - u * u * (3.0 - 2.0 * u), -6.0 * u * (1.0 - u) / self.duration
        heights, velocities, accelerations = self._plan.at(self._begin + passed)
        v1, v2, v3 = velocities
        a1, a2, a3 = accelerations
        slower: Vector3 = (rate * v1, rate * v2, rate * v3)
        squared = rate * rate
        return SliderState(
            heights,
            slower,
            (squared * a1 + bend * v1, squared * a2 + bend * v2, squared * a3 + bend * v3),
        )

    def knots(self) -> FloatArray:
        """Return the instants between which it is smooth: those of the other plan, later."""
        others = self._plan.knots() - self._begin
        others = others[(others > 0.0) & (others < 0.5 * self.duration)]
        low, high = np.zeros(len(others)), np.ones(len(others))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            before = middle * (1.0 - middle**2 * (1.0 - 0.5 * middle)) * self.duration < others
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return ascending(np.concatenate(((0.0,), high * self.duration, (self.duration,))))

    def mixed_series(self, machine: TriGlide, times: FloatArray, half: FloatArray) -> MixedSeries:
        """Return Taylor series of the other plan, composed with those of the time in it."""
        inside = np.clip(times, 0.0, self.duration)
        table = np.array((0.0, 1.0, 0.0, -1.0 / self.duration**2, 0.5 / self.duration**3))
        passed = moved(np.repeat(table[:, np.newaxis, np.newaxis], len(times), axis=2), inside)
        passed[1:, 0, (times < 0.0) | (times >= self.duration)] = 0.0
        inner = polynomial(passed, half)
        there = self._begin + passed[0, 0]
        outer, of_sliders = self._plan.mixed_series(machine, there, half * inner.bounds[1, 0])
        return composed(outer, inner), of_sliders

    def checking_inside(self, _region: Workspace, _limits: SliderLimits) -> Interruptible[None]:
        """Check nothing: the other plan was checked, and this leads to no other place."""
        return
        yield
