"""A controller in each of its states, as it comes there in operation."""

from contextlib import suppress

from controller_rig import MACHINE, Rig

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion import MotionKind
from tri_glide_kinematics.motion.engine import Follow
from tri_glide_kinematics.motion.path import FlatPath

PLACE = (0.0, 0.0, 0.25)
FAR = (0.06, 0.04, 0.32)
TWIST = (0.1, 0.05, 0.05)
CORNERS = ((0.05, 0.0, 0.25), (0.05, 0.05, 0.25), (-0.05, 0.05, 0.3), PLACE)

# Cycles after which each motion is in its middle.
MIDDLE = 60


class Machine(Rig):
    """A controller that is renewed as an operator would, until it is left alone.

    Attributes:
        renew: what is sent in each cycle; nothing at first.
    """

    def __init__(self, start_disabled=False):
        self.renew = lambda: None
        super().__init__(start_disabled, MACHINE.inverse(PLACE), MotionKind.LINEAR, in_pieces=True)
        self.pieces = 30

    def cycle(self, count=1):
        setpoint = None
        for _ in range(count):
            with suppress(KinematicsError):
                self.renew()
            setpoint = super().cycle()
        return setpoint

    def track(self):
        age = self.now - 100.0
        place = (0.05 + 0.05 * age, 0.02, 0.3)
        self.controller.track(place, (0.05, 0.0, 0.0), self.now, self.now)

    def follow(self):
        flat = FlatPath.of([0] * len(CORNERS), [x for p in CORNERS for x in p], (), (), 0.002)
        place = MACHINE.forward(self.controller.commanded_heights)
        self.controller.follow(Follow.made(lambda _: flat.path_from(place), "path"))


def waiting():
    machine = Machine()
    machine.measures = False
    machine.cycle(5)
    return machine


def idle():
    machine = Machine()
    machine.cycle(5)
    return machine


def disabled():
    machine = Machine(start_disabled=True)
    machine.cycle(5)
    return machine


def moving():
    machine = idle()
    machine.controller.move_to(FAR)
    machine.cycle(MIDDLE)
    return machine


def jogging():
    machine = idle()
    machine.renew = lambda: machine.jog(TWIST)
    machine.cycle(MIDDLE)
    return machine


def tracking():
    machine = idle()
    machine.renew = machine.track
    machine.cycle(MIDDLE)
    return machine


def path():
    machine = idle()
    machine.follow()
    machine.cycle(2 * MIDDLE)
    return machine


def paused():
    machine = path()
    machine.controller.pause()
    machine.cycle(4 * MIDDLE)
    return machine


def stopping():
    machine = moving()
    machine.controller.stop()
    machine.cycle(5)
    return machine


def faulty():
    machine = moving()
    machine.offset = 0.04
    machine.cycle(5)
    machine.offset = 0.0
    return machine


STATES = {
    "waiting": waiting,
    "idle": idle,
    "moving": moving,
    "jogging": jogging,
    "tracking": tracking,
    "path": path,
    "paused": paused,
    "stopping": stopping,
    "fault": faulty,
    "disabled": disabled,
}
