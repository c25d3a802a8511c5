"""Masses, force limits, a limit of the platform's speed, and the teach mode of a running node."""

import math

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from std_srvs.srv import SetBool

from testing.client import values_of
from testing.commands import KINEMATICS
from tri_glide_kinematics.control import TEACH_SPEED
from tri_glide_kinematics.dynamics import Arm, Masses, SliderForces

LOW, HIGH = (0.0, 0.0, 0.05), (0.02, 0.01, 0.45)
# Shorter ways, for slow moves.
NEAR, ABOVE = (0.01, 0.0, 0.2), (0.01, 0.0, 0.3)
MASSES = {
    "carriage_masses": [2.0, 2.0, 2.5],
    "arm_masses": [0.3, 0.3, 0.3],
    "platform_mass": 1.0,
    "payload": 0.5,
}
NO_MASSES = {
    "carriage_masses": [0.0, 0.0, 0.0],
    "arm_masses": [0.0, 0.0, 0.0],
    "platform_mass": 0.0,
    "payload": 0.0,
}
NO_LIMIT = [0.0, 0.0, 0.0]
UP = [45.0, 45.0, 50.0]
ROUNDING = 1e-6
# A slider at rest.
STILL = (0.0, 0.0, 0.0)


def forces(payload):
    arm = Arm(0.3)
    return SliderForces(KINEMATICS, Masses((2.0, 2.0, 2.5), (arm, arm, arm), 1.0, payload))


def weight(payload, heights):
    return forces(payload).forces(heights, STILL, STILL)


def set_up(machine, **values):
    result = machine.client.set_parameters("ik_node", values)
    assert result.successful, result.reason


def reason_against(machine, **values):
    result = machine.client.set_parameters("ik_node", values)
    assert not result.successful
    return result.reason


def teach(machine, on):
    answer = machine.client.call(SetBool, "ik_node/teach_mode", SetBool.Request(data=on))
    assert answer.success
    machine.client.wait_for(lambda: machine.states[-1].teach_mode == on, "the teach mode")


def wait_for_limit(machine, speed):
    machine.client.wait_for(lambda: machine.states[-1].platform_speed_limit == speed, "the limit")


def speed_of_move(machine, position):
    """Move, and return the largest speed of the platform on the way [m/s]."""
    begin = machine.client.now()
    machine.move(position)
    return max(
        math.hypot(*KINEMATICS.forward_velocity(message.position, message.velocity)[1])
        for message in machine.commands_since(begin)
    )


def test_the_effort_of_a_resting_machine_is_its_weight(running_machine):
    machine, client = running_machine, running_machine.client
    diagnostics = client.record(DiagnosticArray, "/diagnostics")
    assert len(machine.commands[-1].effort) == 0
    set_up(machine, **MASSES)
    client.wait_for(lambda: machine.commands[-1].effort, "efforts")
    expected = weight(0.5, machine.heights())
    assert list(machine.commands[-1].effort) == pytest.approx(expected, abs=1e-9)

    def told():
        values = map(values_of, client.statuses(diagnostics))
        return [each[name] for each in values if name in each]

    name = "continuous force of slider 3 [N]"
    client.wait_for(told, "the continuous force")
    assert float(told()[0]) == pytest.approx(expected[2], rel=1e-5)
    set_up(machine, payload=2.0)
    expected = weight(2.0, machine.heights())
    client.wait_for(
        lambda: list(machine.commands[-1].effort) == pytest.approx(expected, abs=1e-9), "payload"
    )
    set_up(machine, **NO_MASSES)
    client.wait_for(lambda: not machine.commands[-1].effort, "no efforts")


def test_force_limits_hold_for_the_efforts_and_have_to_hold_the_weight(running_machine):
    machine = running_machine
    text = reason_against(machine, force_limit_up=UP)
    assert "force_limit_up = [45, 45, 50] N needs masses" in text
    set_up(machine, **MASSES)
    machine.client.wait_for(lambda: machine.commands[-1].effort, "efforts")
    assert max(effort for effort, _ in efforts_of_move(machine, LOW, HIGH)) > 50.0
    set_up(machine, force_limit_up=UP)
    assert "cannot hold the weight: slider" in reason_against(machine, payload=10.0)
    # A payload that comes in mid-motion.
    machine.move(LOW)
    machine.get_going(HIGH, 0.3)
    set_up(machine, payload=0.8)
    machine.wait_for_state("idle")
    used = [effort / limit for effort, limit in efforts_of_move(machine, LOW, HIGH)]
    assert 0.9 < max(used) <= 1.0 + ROUNDING
    set_up(machine, **NO_MASSES, force_limit_up=NO_LIMIT)


def efforts_of_move(machine, first, second):
    """Move there and on; return the efforts of the second way, each with its limit [N]."""
    machine.move(first)
    begin = machine.client.now()
    machine.move(second)
    return [pair for message in machine.commands_since(begin) for pair in zip(message.effort, UP)]


def test_the_lower_one_of_teach_mode_and_speed_limit_holds(running_machine):
    machine = running_machine
    assert machine.states[-1].platform_speed_limit == 0.0
    machine.move(LOW)
    assert speed_of_move(machine, HIGH) > 2.0 * TEACH_SPEED
    set_up(machine, platform_speed_limit=0.4)
    teach(machine, True)
    for limit, holds, place in ((0.4, TEACH_SPEED, NEAR), (0.15, 0.15, ABOVE)):
        set_up(machine, platform_speed_limit=limit)
        wait_for_limit(machine, holds)
        assert 0.95 * holds < speed_of_move(machine, place) <= holds * (1.0 + ROUNDING)
    teach(machine, False)
    set_up(machine, platform_speed_limit=0.0)
    wait_for_limit(machine, 0.0)


def test_a_node_does_not_start_with_force_limits_that_it_cannot_keep(nodes):
    node = nodes.start("ik_node", {**MASSES, "force_limit_up": [20.0, 0.0, 0.0]})
    node.exit_codes = (1,)
    assert node.process.wait(60.0) == 1
    assert "force_limit_up[0] = 20 N cannot hold" in node.output


def test_a_simulated_machine_with_masses_is_driven_by_efforts(running_machine):
    """Its drives hold the weight with the feed-forward, and the moves end where they should."""
    machine = running_machine
    drives = {"drive_stiffness": [20000.0] * 3, "drive_damping": [400.0] * 3}
    answer = machine.client.set_parameters("simulator_node", drives)
    assert not answer.successful
    assert "drive_stiffness = [20000, 20000, 20000] N/m needs masses" in answer.reason
    set_up(machine, **MASSES)
    machine.client.wait_for(lambda: machine.commands[-1].effort, "efforts")
    answer = machine.client.set_parameters("simulator_node", {**MASSES, **drives})
    assert answer.successful, answer.reason
    machine.client.wait_for(lambda: machine.measured[-1].effort, "forces of the drives")
    machine.move(HIGH)
    machine.move(LOW)
    machine.wait_for_measured_rest()
    expected = weight(0.5, machine.heights())
    machine.client.wait_for(
        lambda: list(machine.measured[-1].effort) == pytest.approx(expected, abs=0.05), "rest"
    )
    assert list(machine.measured[-1].position) == pytest.approx(machine.heights(), abs=1e-5)
    off = {name: NO_LIMIT for name in drives}
    assert machine.client.set_parameters("simulator_node", {**NO_MASSES, **off}).successful
    machine.client.wait_for(lambda: not machine.measured[-1].effort, "no forces")
    set_up(machine, **NO_MASSES)
