"""One cycle after the other: the next step towards what is wanted, with a certified way to rest.

A step is taken only if the whole of it and a braking that could follow keep all limits. Otherwise
what the caller holds goes on: it is the braking of the step before, which was certified with it.
"""

from __future__ import annotations

from collections.abc import Iterator

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.interruptible import Interruptible, at_once
from tri_glide_kinematics.motion.errors import SOUND
from tri_glide_kinematics.motion.limits import SliderLimits, SliderState
from tri_glide_kinematics.motion.tracking.clearance import TRACE_SAMPLES, first_certified
from tri_glide_kinematics.motion.tracking.moving_target import Wanted, WantedVelocity
from tri_glide_kinematics.motion.tracking.slider_way import (
    FEWEST_STEPS,
    SliderWay,
    braking_alone,
    braking_together,
)
from tri_glide_kinematics.motion.tracking.target_tracking import TargetTracking, straight_towards
from tri_glide_kinematics.motion.tracking.velocity_tracking import VelocityTracking
from tri_glide_kinematics.motion.trajectory import TrackedStep, gentler
from tri_glide_kinematics.workspace import Workspace

# A step that is prepared has time for so many places of its way.
PREPARED_SAMPLES = 100


class Follower:
    """Steps of a machine towards velocities and moving targets.

    Attributes:
        horizon: how long after a step what is wanted is to be reached [s].
    """

    def __init__(self, workspace: Workspace, horizon: float = 0.0) -> None:
        """Prepare for a ``workspace`` and its machine, with a ``horizon`` [s] or none."""
        self._workspace = workspace
        self._velocities = VelocityTracking(workspace)
        self._targets = TargetTracking(workspace)
        self.horizon = horizon

    def step(
        self, state: SliderState, wanted: Wanted, limits: SliderLimits, period: float
    ) -> TrackedStep | None:
        """Return the next step, if there is one that is certified with the braking behind it.

        Args:
            state: where the step begins.
            wanted: as of the end of the step: a target is to be extrapolated to then by the caller
                (``MovingTarget.after``).
            limits: of the sliders, for the step and the braking.
            period: of the step [s].

        Returns:
            The step; None if the limits cannot be kept from this state on, a target is outside
            the workspace or has no pose, or the step would leave no way to rest that can be shown
            to be one. The braking that is held then goes on.
        """
        return at_once(
            self.step_in_pieces(state, wanted, limits, period, TRACE_SAMPLES, self.horizon)
        )

    def step_in_pieces(
        self,
        state: SliderState,
        wanted: Wanted,
        limits: SliderLimits,
        period: float,
        samples: int = PREPARED_SAMPLES,
        horizon: float | None = None,
    ) -> Interruptible[TrackedStep | None]:
        """Return the next step, as ``step`` does, from so many ``samples`` of a way at most.

        Steps that are prepared are long: the horizon of each is as long as some of them, unless the
        one that is set is 0.
        """
        if horizon is None:
            horizon = FEWEST_STEPS * period if self.horizon > 0.0 else 0.0
        for used in gentler(limits, state):
            try:
                with SOUND:
                    step = yield from self._step(
                        state, wanted, used, limits, period, samples, horizon
                    )
                if step is not None:
                    return step
            except KinematicsError:
                continue
        return None

    def _step(
        self,
        state: SliderState,
        wanted: Wanted,
        used: SliderLimits,
        limits: SliderLimits,
        period: float,
        samples: int,
        horizon: float,
    ) -> Interruptible[TrackedStep | None]:
        """Return the step that uses no more than some limits, if it is certified for ``limits``."""
        for ways in self._ways(state, wanted, used, period, horizon):
            choices = (
                [[*way.phases, *braking] for way, braking in zip(ways, brakes(ways, used))]
                for brakes in (braking_together, braking_alone)
            )
            certified = yield from first_certified(self._workspace, state, choices, limits, samples)
            if certified is not None:
                one, two, three = ways
                h1, h2, h3 = state.heights
                after = SliderState(
                    (h1 + one.displacement, h2 + two.displacement, h3 + three.displacement),
                    (one.velocity, two.velocity, three.velocity),
                    (one.acceleration, two.acceleration, three.acceleration),
                )
                return TrackedStep(state, after, period, certified.ways, certified.duration)
        return None

    def _ways(
        self,
        state: SliderState,
        wanted: Wanted,
        used: SliderLimits,
        period: float,
        horizon: float,
    ) -> Iterator[list[SliderWay]]:
        """Yield what the sliders may do in the step, the best first."""
        if isinstance(wanted, WantedVelocity):
            yield self._velocities.step_towards(state, wanted, used, period, horizon)
            return
        yield self._targets.step_towards(state, wanted, used, period, horizon)
        # The sliders' shortest ways bend. The straight one of the platform leaves nothing but
        # bounds that are not convex.
        place = self._workspace.machine.forward(state.heights)
        straight = WantedVelocity(straight_towards(place, wanted, used))
        yield self._velocities.step_towards(state, straight, used, period)
