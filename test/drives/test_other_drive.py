"""Our group of drives leads drives that share no code with us, in virtual time.

They were written from the standards alone, and are as strict as these allow.
"""

from contextlib import contextmanager
from operator import sub
from types import SimpleNamespace

import pytest
from group_rig import LOWER, NODES, PERIOD, QUICK, UPPER, ZONE, GroupRig, settings

from testing.other_drive import TICK, AbortError, Axis, Dictionary, Drive, Node
from testing.simulated_bus import SimulatedBus
from tri_glide_kinematics.drives import AbortError as OurAbortError
from tri_glide_kinematics.drives import DriveGroup, GroupState

SCALE = 1e6  # counts per metre
END = 0.03  # m, from a limit switch to the hard stop
MOST = 60.0  # m/s^2


class OtherDrive:
    """One of them, as our simulated bus asks its drives."""

    answers = True
    faults = SimpleNamespace(answer_delay=0.0)

    def __init__(self, node: int, way: int, height: float, home_sign: int) -> None:
        self.node, self.way = node, way
        self.events: list[dict] = []
        self._sent: list[tuple[int, bytes]] = []
        switches = sorted(way * SCALE * each for each in (LOWER, UPPER - ZONE))
        stops = switches[0] - SCALE * END, switches[1] + SCALE * END
        self.axis = Axis(way * SCALE * height, stops, tuple(switches), SCALE * MOST)
        self.drive = Drive(Dictionary(node, SCALE), self.axis, home_sign, self._tell)
        self._node = Node(self.drive, lambda *frame: self._sent.append(frame))

    def _tell(self, event, **numbers):
        self.events.append({"event": event, **numbers})

    def told(self, event):
        return [each for each in self.events if each["event"] == event]

    def advance(self, now):
        while self._node.now + TICK <= now + 1e-9:
            self._node.now += TICK
            self._node.tick()
        sent, self._sent[:] = list(self._sent), []
        return sent

    def receive(self, frame):
        self._node.receive(*frame)

    def read(self, *place):
        with self._refusing():
            return self._node.read(*place)

    def write(self, *place_and_data):
        with self._refusing():
            self._node.write(*place_and_data)

    @contextmanager
    def _refusing(self):
        try:
            yield
        except AbortError as error:
            raise OurAbortError(error.args[0]) from None


class OtherRig(GroupRig):
    """Three of them; the second one counts downwards."""

    def __init__(self, home_sign=-1):
        self.settings = settings(**QUICK)
        ways = [each.units.direction for each in self.settings.drives]
        self.drives = [OtherDrive(node, way, 0.6, home_sign) for node, way in zip(NODES, ways)]
        self.bus = SimulatedBus(self.drives)
        self.group = DriveGroup(self.bus, self.settings)
        self.now = 0.0

    @property
    def true_heights(self):
        return tuple(each.way * each.axis.place / SCALE for each in self.drives)

    @property
    def errors(self):
        """Measured heights minus the true ones [m]."""
        return tuple(map(sub, self.group.heights, self.true_heights))


@pytest.mark.parametrize(
    "home_sign", [-1, 1], ids=["home as CiA 402 words it", "home as many drives have it"]
)
def test_they_are_homed_and_follow_setpoints_of_which_one_comes_with_each_sync(home_sign):
    rig = OtherRig(home_sign).homed()
    # By how much the axis moves in a tick at the slow speed of homing.
    assert rig.errors == pytest.approx((0.0,) * 3, abs=QUICK["homing_slow_speed"] * TICK)
    errors = rig.errors
    rig.swing(1.0)
    assert rig.group.state is GroupState.ON, rig.group.message
    rig.until(GroupState.HOLDING).run(0.5)
    assert rig.errors == pytest.approx(errors, abs=10.0 / SCALE)
    for drive in rig.drives:
        assert not drive.told("targets") and not drive.told("length")
    rig.group.disable(rig.now)
    rig.off()
    assert [each.told("state")[-1]["state"] for each in rig.drives] == ["disabled"] * 3


def test_a_fault_of_one_stops_all_and_is_reset():
    rig = OtherRig().homed()
    rig.drives[1].drive.fault(0x7305)
    rig.until(GroupState.FAULT).run(0.5)
    assert "axis 2" in rig.group.message and "0x7305" in rig.group.message
    rig.group.reset(rig.now)
    rig.off().on()


def test_they_stop_by_themselves_where_the_computer_is_gone():
    rig = OtherRig().homed()
    for _ in range(round(1.0 / PERIOD)):
        rig.now += PERIOD
        rig.bus.advance(rig.now)
    assert all(each.drive.state != 0x27 for each in rig.drives)
    rig.run(0.1).until(GroupState.FAULT)
