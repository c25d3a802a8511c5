"""A machine that follows something, as an engine would have it do."""

from collections.abc import Callable

import numpy as np
from motion_machine import LIMITS, MACHINE, WORKSPACE

from tri_glide_kinematics.motion.limits import AT_REST, SliderLimits, SliderState
from tri_glide_kinematics.motion.tracking import Follower, Wanted
from tri_glide_kinematics.motion.trajectory import TrackedStep
from tri_glide_kinematics.vectors import FloatArray, Vector3
from tri_glide_kinematics.workspace import Workspace

PLACE = (0.0, 0.0, 0.3)
PERIODS = (0.001, 0.002, 0.004, 0.01)  # s


def at_rest(place: Vector3 = PLACE) -> SliderState:
    """Return the sliders of a platform that rests at a place [m]."""
    return SliderState(MACHINE.inverse(place), AT_REST, AT_REST)


class TrackingRun:
    """Takes each certified step, and else goes on with the braking that it holds."""

    def __init__(self, place: Vector3 = PLACE, workspace: Workspace = WORKSPACE) -> None:
        """Begin at rest."""
        self.follower = Follower(workspace)
        self.machine = workspace.machine
        state = SliderState(self.machine.inverse(place), AT_REST, AT_REST)
        self.states = [state]
        self.held: TrackedStep | None = None
        self.held_since = 0.0
        self.refused = 0

    @property
    def state(self) -> SliderState:
        """The sliders now."""
        return self.states[-1]

    def step(self, wanted: Wanted, limits: SliderLimits = LIMITS, period: float = 0.002) -> bool:
        """Do one cycle; tell whether a new step was taken."""
        step = self.follower.step(self.state, wanted, limits, period)
        if step is not None:
            self.held, self.held_since = step, period
            self.states.append(step.after)
            return True
        self.refused += 1
        self.held_since += period
        self.states.append(self.held.at(self.held_since) if self.held else self.state)
        return False

    def run(
        self, wanted: Callable[[float], Wanted], duration: float, period: float = 0.002, **options
    ) -> FloatArray:
        """Follow what is wanted at the end of each step; return all places. Shape (n, 3) [m]."""
        for cycle in range(round(duration / period)):
            self.step(wanted((cycle + 1) * period), period=period, **options)
        return self.places

    @property
    def places(self) -> FloatArray:
        """Places of the platform. Shape (n, 3) [m]."""
        return np.array([self.machine.forward(state.heights) for state in self.states])

    @property
    def velocities(self) -> FloatArray:
        """Velocities of the platform. Shape (n, 3) [m/s]."""
        return np.array([self.machine.forward_velocity(*state[:2])[1] for state in self.states])

    @property
    def rests(self) -> bool:
        """Whether the sliders rest, exactly."""
        return not any((*self.state.velocities, *self.state.accelerations))
