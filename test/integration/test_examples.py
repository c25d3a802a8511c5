"""The scripts in examples/, run as a user runs them."""

import os
import subprocess
import sys
from itertools import cycle
from pathlib import Path

import pytest
from sensor_msgs.msg import Joy

from testing.machine import RATE
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide

EXAMPLES = Path(__file__).parents[2] / "examples"
MACHINE = TriGlide(DEFAULT_GEOMETRY)
TIMEOUT = 60.0  # s


def start(script, *arguments, namespace=None):
    """Start an example, its topics in a namespace if it has some."""
    command = [sys.executable, str(EXAMPLES / script), *map(str, arguments)]
    if namespace is not None:
        command += ["--ros-args", "-r", f"__ns:={namespace}"]
    return subprocess.Popen(
        command, env=os.environ, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def end_of(process):
    """Return the exit code and the output of an example that ends by itself."""
    try:
        output, _ = process.communicate(timeout=TIMEOUT)
    finally:
        process.kill()
        process.wait()
    return process.returncode, output


@pytest.mark.parametrize(
    ("script", "expected"),
    [
        ("solve_a_four_bar.py", ["crank-rocker", "88.837", "117.286", "-143.660"]),
        ("follow_a_branch.py", ["-75.688", "-0.982 deg: the cranks turn fully", "135.044"]),
    ],
)
def test_mathematics(script, expected):
    code, output = end_of(start(script))
    assert code == 0, output
    for text in expected:
        assert text in output


def test_a_motion_is_recorded_and_drawn(running_machine, tmp_path):
    machine, client = running_machine, running_machine.client
    picture = tmp_path / "motion.png"
    recorder = start("plot_a_motion.py", picture, namespace=client.namespace)
    targets = cycle([(0.03, 0.02, 0.3), (0.0, 0.0, 0.25)])

    def recorded():
        # Its first motion may be over before the recorder hears anything.
        machine.move(next(targets))
        return recorder.poll() is not None

    client.wait_for(recorded, "the recorder to have a motion")
    code, output = end_of(recorder)
    assert code == 0, output
    assert "setpoints in" in output
    assert picture.stat().st_size > 10_000


def test_a_joystick_jogs_while_its_button_is_held(running_machine):
    machine, client = running_machine, running_machine.client
    jog = start("jog_with_joystick.py", namespace=client.namespace)
    try:
        publisher = client.publisher(Joy, "joy")
        client.wait_for_subscribers(publisher)

        def stick(held):
            publisher.publish(Joy(axes=[0.0, 0.0, 0.0, 0.0, 1.0], buttons=[0, 0, 0, 0, 0, held]))

        def has_jogged():
            stick(1)
            way = min(now - then for now, then in zip(machine.heights(), before))
            return machine.state == "jogging" and way > 1e-4

        stick(0)
        before = machine.heights()
        client.wait_for(has_jogged, "the jog")
        stick(0)
        machine.wait_for_state("idle")
    finally:
        jog.terminate()
        jog.wait(TIMEOUT)


def test_a_path_is_followed_with_a_rest_on_the_way(running_machine):
    machine = running_machine
    machine.move((0.0, 0.0, 0.25))
    first = len(machine.commands)
    code, output = end_of(start("follow_a_path.py", namespace=machine.namespace))
    assert code == 0, output
    assert "path of 4 segments is reached" in output
    machine.catch_up()
    places = [MACHINE.forward(machine.heights(message)) for message in machine.commands[first:]]
    # Half of the way is the corner opposite to the start.
    assert max(x + y for x, y, _ in places) > 0.0575
    assert places[-1] == pytest.approx((0.0, 0.0, 0.25), abs=1e-6)
    speeds = [max(map(abs, message.velocity)) for message in machine.commands[first:]]
    moving = [index for index, speed in enumerate(speeds) if speed > 0.0]
    at_rest = [index for index in range(moving[0], moving[-1]) if speeds[index] == 0.0]
    # A second, from when a busy computer has the pause until it has the end of it.
    assert len(at_rest) > 0.2 * RATE
