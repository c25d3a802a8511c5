"""A wall clock that is set, back and forth, neither holds a node nor changes a motion."""

import pytest
import yaml
from rcl_interfaces.srv import ListParameters

from testing.client import TIMEOUT
from testing.commands import KINEMATICS, assert_within_limits
from testing.wall_clock import HOUR, WallClock

NEAR, FAR = (0.0, 0.0, 0.25), (0.05, 0.03, 0.32)
SETTINGS = (-HOUR, 2.0 * HOUR, HOUR, -3.0 * HOUR, 0.0)


@pytest.fixture
def clock(tmp_path):
    return WallClock(tmp_path)


# They look at services in each cycle, beside one that waits for its time or for messages, and by
# rclpy alone.
NODES = ("ik_node", "calibration_node", "fk_node", "mechanism_node")


def test_a_clock_that_is_set_holds_no_node(client, nodes, clock):
    for name in NODES:
        nodes.start(name, {}, prefix=clock.prefix)
    for ahead in (*SETTINGS, 0.0):
        for name in NODES:
            client.call(ListParameters, f"{name}/list_parameters", ListParameters.Request())
        clock.set_ahead(ahead)


@pytest.mark.slow
def test_a_clock_that_is_set_holds_no_command(machine, client, nodes, clock, tmp_path):
    file = tmp_path / "drive.yaml"
    steps = [{"wait": {"seconds": 0.3}}] * len(SETTINGS)
    file.write_text(yaml.safe_dump({"steps": [*steps, {"move": {"to": list(FAR)}}]}))
    machine.start()
    machine.wait_for_state("idle")
    drive = nodes.start("drive", arguments=("--", str(file)), prefix=clock.prefix)
    for number, ahead in enumerate(SETTINGS):
        name = f"step {number + 1} of"
        client.wait_for(lambda name=name: name in drive.output, name)
        clock.set_ahead(ahead)
    assert drive.process.wait(TIMEOUT) == 0, drive.output


@pytest.mark.slow
def test_a_clock_that_is_set_in_motion_stops_no_setpoints_and_a_stop_is_heard(
    machine, client, clock
):
    machine.start({"speed_scale": 0.05}, prefix=clock.prefix)
    client.stop()
    machine.wait_for_state("idle")
    for place, is_stopped in ((FAR, False), (NEAR, True)):
        machine.get_going(place, 0.03)
        for ahead in SETTINGS:
            count = len(machine.commands)
            clock.set_ahead(ahead)
            client.wait_for(lambda count=count: len(machine.commands) > count + 3, "setpoints")
        if is_stopped:
            client.stop()
        machine.wait_for_state("idle")
        client.wait_for(lambda: not any(machine.commands[-1].velocity), "rest")
        is_there = machine.heights() == pytest.approx(KINEMATICS.inverse(place), abs=1e-5)
        assert is_there is not is_stopped
    assert_within_limits(machine, speed_scale=0.05)
