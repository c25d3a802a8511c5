"""Each fault in each state of a machine, and what it did: ``python test/fault_campaign.py``.

All is as in the node but for the messages: controller, engine and supervision; the measured heights
are those of a machine that follows.
"""

from contextlib import suppress
from typing import NamedTuple

from controller_rig import violations_of
from machine_states import STATES

from tri_glide_kinematics.control import Cause, Reason
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.motion.engine import Follow
from tri_glide_kinematics.ros.inputs import path_points

CYCLES = 250  # that are watched after a fault: half a second


def hostile_bytes(machine):
    machine.controller.follow(
        Follow.made(lambda _: path_points(b"\0\7\0\0", "tri_glide_base"), "path in 4 bytes")
    )


def silence(machine):
    machine.measures = False


def jump(machine):
    machine.offset = 0.04


def drift(machine):
    renew = machine.renew

    def drift_and_renew():
        machine.offset = min(machine.offset + 0.0005, 0.1)
        renew()

    machine.renew = drift_and_renew


def stop(machine):
    machine.controller.stop()


def signal(machine):
    machine.controller.end("the node ends")


def second_publisher(machine):
    machine.controller.set_obstacle(
        Reason(Cause.OTHER_PUBLISHER, "another node publishes setpoints")
    )


def broken_planner(machine):
    try:
        raise RuntimeError("the planner is broken")
    except RuntimeError as error:
        machine.controller.fail(error)


FAULTS = {
    "bytes that are no path": hostile_bytes,
    "no measurements": silence,
    "measured heights jump": jump,
    "measured heights drift": drift,
    "`~/stop`": stop,
    "SIGINT, SIGTERM": signal,
    "second publisher": second_publisher,
    "error in the planner": broken_planner,
}


class Outcome(NamedTuple):
    """What the machine did.

    Attributes:
        states: names of those that it went through, the one at the fault first.
        is_led: whether there are setpoints in the end.
        rests: whether the last setpoint was one of rest.
        violations: of the limits of the sliders by finite differences.
    """

    states: list[str]
    is_led: bool
    rests: bool
    violations: list[str]

    @property
    def text(self) -> str:
        """What is told of it in the table."""
        states = " → ".join(self.states)
        return states if self.is_led else f"{states}, no setpoints"


def run(state, fault):
    """Return what a machine in a ``state`` did after a ``fault``."""
    machine = STATES[state]()
    controller = machine.controller
    names = [controller.state.name.lower()]
    with suppress(KinematicsError):
        fault(machine)
    heights = [machine.heights]
    for _ in range(CYCLES):
        with suppress(KinematicsError):
            setpoint = machine.cycle()
        if controller.leads:
            heights.append(machine.heights)
        name = controller.state.name.lower()
        if name != names[-1]:
            names.append(name)
    started = machine.engine.started
    return Outcome(
        names,
        setpoint is not None,
        not started or not any(machine.engine.state.velocities),
        violations_of(heights) if len(heights) > 4 else [],
    )


def outcomes():
    """Return what all machines did, by state and fault."""
    return {(state, fault): run(state, call) for fault, call in FAULTS.items() for state in STATES}


def table(found):
    """Return the lines of the table in the documents."""
    lines = ["| state | " + " | ".join(FAULTS) + " |", "|---" * (len(FAULTS) + 1) + "|"]
    for state in STATES:
        cells = " | ".join(found[state, fault].text for fault in FAULTS)
        lines.append(f"| {state} | {cells} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table(outcomes()))
