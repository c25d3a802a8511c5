"""A node loads no code once it controls a machine: its cycle would wait for that."""

import re

from action_bench import NEAR, ActionBench
from nav_msgs.msg import Path
from std_srvs.srv import Trigger

from testing.goal_storm import GoalStorm
from testing.goals import GoalClient
from testing.processes import launched
from tri_glide_interfaces.action import FollowPath
from tri_glide_kinematics.motion.engine import GoalCode

LINE, ARC_THROUGH = FollowPath.Goal.LINE, FollowPath.Goal.ARC_THROUGH
IMPORT = re.compile(r"^import time:.*\|(.*)$", re.MULTILINE)


def asked(bench, service):
    return bench.client.call(Trigger, f"ik_node/{service}", Trigger.Request())


def drive_paths(bench):
    """Drive a line, then arcs and rounded corners, append, pause, and go on."""
    bench.set_speed(1.0)
    assert bench.goals.follow([NEAR]).result().code == GoalCode.SUCCEEDED
    bench.quickly_to(NEAR)
    goal = bench.goals.follow(
        [],
        kinds=[LINE, ARC_THROUGH, LINE],
        numbers=[0.02, 0.0, 0.25, 0.03, 0.01, 0.25, 0.02, 0.02, 0.25, 0.0, 0.02, 0.25],
        tolerances=[0.001],
    ).wait_until_accepted()
    appended = bench.goals.follow([(0.0, 0.0, 0.25), (-0.02, 0.0, 0.25)], append=True)
    appended.wait_until_accepted()
    # While the longer path is being planned, it is refused.
    bench.client.wait_for(lambda: asked(bench, "pause").success, "a pause")
    assert asked(bench, "resume").success
    bench.set_speed(1.0)
    for each in (goal, appended):
        assert each.result().code == GoalCode.SUCCEEDED


def send_targets(bench):
    """Send what is followed without an answer, and what is no path."""
    bench.client.send_state((0.02, 0.0, 0.26), (0.01, 0.0, 0.0))
    bench.machine.wait_for_state("tracking")
    publisher = bench.client.publisher(Path, "target_path")
    bench.client.wait_for_subscribers(publisher)
    message = Path()
    message.header.frame_id = "world"
    publisher.publish(message)
    bench.client.wait_for(lambda: "'world'" in bench.machine.ik.output, "the refusal")


def test_ik_node_loads_nothing_while_it_is_used(client, tmp_path, namespace, monkeypatch):
    monkeypatch.setenv("PYTHONPROFILEIMPORTTIME", "1")
    with launched(tmp_path, namespace) as nodes:
        bench = ActionBench(client, nodes).start()
        assert "numpy" in [name.strip() for name in IMPORT.findall(bench.machine.ik.output)]
        bench.machine.ik.forget_output()
        drive_paths(bench)
        send_targets(bench)
        bench.under_way().cancel()
        bench.quickly_to(NEAR)
        bench.set_speed(1.0)
        report = GoalStorm(bench.machine, GoalClient(bench.client), seed=7).run(20)
        assert report.wrong == []
        assert report.codes.total() >= 20
        assert set(report.codes) >= {GoalCode.SUCCEEDED, GoalCode.SUPERSEDED}
        assert [name.strip() for name in IMPORT.findall(bench.machine.ik.output)] == []
