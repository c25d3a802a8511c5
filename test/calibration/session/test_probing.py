"""A probe against a platform that does as it is told, and against all that can come between."""

import pytest

from tri_glide_kinematics.calibration.session import (
    BACK_TOLERANCE,
    LONGEST_STOP,
    MachineView,
    Probe,
    ProbePhase,
    ProbeSettings,
)
from tri_glide_kinematics.control import (
    DISABLED,
    FAULT,
    IDLE,
    JOGGING,
    MOVING,
    PAUSED,
    STOPPING,
    TRACKING,
    WAS_STOPPED,
    Cause,
)

START = (0.03, -0.02, 0.05)
PERIOD = 0.005
SETTINGS = ProbeSettings(speed=0.002, depth=0.008, contact_timeout=0.5)


def told(state, cause=Cause.COMMAND, stops=0):
    return MachineView(state, cause, "as told", stops)


class Platform:
    """Moves as ik_node would, with a switch at a height; what goes wrong is set by attributes."""

    def __init__(self, plate, settings=SETTINGS):
        self.plate = plate
        self.now = 100.0
        self.position = list(START)
        self.speed = 0.0
        self.target = None
        self.state = IDLE
        self.drift = 0.0
        self.is_silent = False
        self.is_switch_dead = False
        self.is_stuck = False
        self.commands = []
        self.probe = Probe(settings, START, self.now)

    def step(self):
        command = self.probe.step(self.now)
        if command is not None:
            self.commands.append(command)
            self.speed = 0.0 if self.is_stuck else command
            self.state = JOGGING if command else IDLE
        self.now += PERIOD
        self.position[0] += self.drift * PERIOD
        self.position[2] += self.speed * PERIOD
        if not self.is_silent:
            self.probe.measured(tuple(self.position), self.now)
        self.probe.machine(told(self.state), self.now)
        if not self.is_switch_dead:
            self.probe.contact(self.position[2] <= self.plate, self.now + 1e9, self.now)
        if self.speed == 0.0 and self.probe.phase is ProbePhase.STOPPING:
            self.probe.at_rest(self.now)

    def run(self, seconds=30.0):
        """Go on until the probe has ended, and return it."""
        end = self.now + seconds
        while self.probe.phase is not ProbePhase.ENDED:
            assert self.now < end, self.probe.phase
            self.step()
        return self.probe

    def assert_is_back(self):
        assert self.position == pytest.approx(START, abs=2.0 * BACK_TOLERANCE)

    def run_until(self, height):
        while self.position[2] > height:
            self.step()


def on_its_way_down():
    """Return a platform 3 mm above its plate."""
    platform = Platform(plate=0.046)
    platform.run_until(0.049)
    return platform


@pytest.mark.parametrize(
    ("wrong", "words", "goes_back"),
    [
        ({"is_switch_dead": True}, "nothing about the contact for 0.5 s", True),
        ({"is_silent": True}, "no measured heights for 0.5 s", False),
        ({"is_stuck": True, "speed": 0.0}, "does not go down", True),
        ({"drift": 0.01}, "away from its way down: somebody else leads it", False),
    ],
)
def test_what_goes_wrong_on_the_way_down_ends_it(wrong, words, goes_back):
    platform = on_its_way_down()
    platform.plate = 0.0
    vars(platform).update(wrong)
    probe = platform.run()
    assert words in probe.failure
    assert probe.lowest > 0.0475
    assert any(command > 0.0 for command in platform.commands) is goes_back
    if platform.is_switch_dead:
        platform.assert_is_back()


@pytest.mark.parametrize(
    ("state", "text"),
    [
        (MOVING, "ik_node is moving: as told"),
        (TRACKING, "ik_node is tracking: as told"),
        (PAUSED, "ik_node is paused: as told"),
        (FAULT, "ik_node is fault: as told"),
        (DISABLED, "ik_node is disabled: as told"),
        (STOPPING, "it was stopped: as told"),
        (IDLE, "it was stopped: as told"),
    ],
)
def test_who_else_leads_the_machine_is_left_to_it(state, text):
    platform = on_its_way_down()
    count = len(platform.commands)
    platform.probe.machine(told(state), platform.now)
    assert platform.probe.phase is ProbePhase.ENDED
    assert platform.probe.failure == text
    assert platform.probe.step(platform.now) is None
    assert len(platform.commands) == count


@pytest.mark.parametrize("state", [STOPPING, IDLE])
def test_a_stop_between_the_way_down_and_the_way_back_ends_it(state):
    platform = Platform(plate=0.046)
    while platform.probe.phase is ProbePhase.DOWN:
        platform.step()
    assert platform.probe.phase is ProbePhase.STOPPING
    platform.probe.machine(told(state, stops=1), platform.now)
    assert platform.probe.phase is ProbePhase.ENDED
    assert platform.probe.failure == WAS_STOPPED
    assert platform.probe.step(platform.now) is None


def test_another_command_ends_it_in_any_phase():
    platform = on_its_way_down()
    platform.probe.end("another")
    assert (platform.probe.phase, platform.probe.failure) == (ProbePhase.ENDED, "another")
    platform.probe.end("once more")
    assert platform.probe.failure == "another"


def test_time_in_which_nobody_listened_is_no_silence():
    platform = on_its_way_down()
    platform.now += 0.4
    assert platform.run().failure is None


@pytest.mark.parametrize(("timeout", "gap"), [(0.5, 3.0), (0.5, 0.6), (0.0, 0.6), (0.2, 0.3)])
def test_a_probe_that_was_held_up_itself_ends(timeout, gap):
    platform = Platform(plate=0.046, settings=ProbeSettings(0.002, 0.008, timeout))
    platform.run_until(0.049)
    count = len(platform.commands)
    platform.now += gap
    assert "this node was held up for" in platform.run().failure
    assert len(platform.commands) == count


def on_its_way_back():
    """Return a platform that has touched its plate and is 1 mm above it again."""
    platform = Platform(plate=0.046)
    while platform.probe.phase is not ProbePhase.BACK or platform.position[2] < 0.047:
        platform.step()
    return platform


@pytest.mark.parametrize(
    ("plate", "sinks", "failure"),
    [
        (1.0, 0.0, "the contact closes on the way back"),
        (0.046, 4e-4, "the platform moves down on its way back"),
    ],
)
def test_what_goes_wrong_on_the_way_back_is_a_failure_with_a_stop(plate, sinks, failure):
    platform = on_its_way_back()
    platform.plate = plate
    platform.probe.measured((*START[:2], platform.position[2] - sinks), platform.now)
    assert platform.run().failure == failure
    assert platform.commands[-1] == 0.0
    assert platform.position[2] < 0.0475


@pytest.mark.parametrize("state", [IDLE, STOPPING, DISABLED, FAULT, MOVING, None])
def test_a_stop_by_another_ends_the_way_back(state):
    platform = on_its_way_back()
    count = len(platform.commands)
    platform.probe.machine(told(state), platform.now)
    assert platform.probe.phase is ProbePhase.ENDED
    assert "as told" in platform.probe.failure
    assert len(platform.commands) == count


def test_no_rest_is_told():
    platform = Platform(plate=0.046)
    while platform.probe.phase is not ProbePhase.STOPPING:
        platform.step()
    platform.state, platform.is_stuck = STOPPING, True
    platform.probe.machine(told(STOPPING), platform.now)
    for _ in range(int((LONGEST_STOP + 0.1) / PERIOD)):
        platform.now += PERIOD
        platform.probe.step(platform.now)
    assert platform.probe.failure == "the sliders do not come to rest within 5 s"


def test_a_platform_that_does_not_come_back_is_told():
    platform = on_its_way_back()
    platform.is_stuck = True
    probe = platform.run()
    assert "the platform is not back after 15.4 s: ik_node is jogging: as told" in probe.failure
    assert probe.contact_stamp is not None
