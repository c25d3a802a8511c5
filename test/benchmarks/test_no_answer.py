"""A benchmark whose nodes do not answer tells why, and the others go on."""

import os
import signal
import sys
from types import SimpleNamespace

import pytest

from benchmarks import __main__ as benchmarks
from benchmarks import ros_session
from benchmarks.harness import Missing, NoAnswerError, attempt, figure
from benchmarks.ros_session import session
from tri_glide_kinematics.ros.starting import MIDDLEWARE_VARIABLES, VARIABLE


@pytest.fixture
def running(monkeypatch):
    """Return a session on the loopback address, which waits for a second only."""
    for variable in (*MIDDLEWARE_VARIABLES, VARIABLE, "ROS_DOMAIN_ID"):
        monkeypatch.setenv(variable, "")  # so that what the session sets is undone
    with session() as started:
        monkeypatch.setattr(ros_session, "TIMEOUT", 1.0)
        yield started


@pytest.mark.nodes
def test_it_says_which_node_is_in_which_state(running, monkeypatch):
    monkeypatch.setattr(ros_session, "STATUS_TIMEOUT", 30.0)
    running.start_node("ik_node", "/ours")
    bare = running.start_bare("bare", "/bare")
    os.kill(bare, signal.SIGKILL)
    with pytest.raises(NoAnswerError) as raised:
        running.spin_until(lambda: False, "the impossible")
    text = str(raised.value)
    assert text.startswith(
        "waited 1 s in vain for the impossible: ik_node in /ours is running, waiting"
    )
    assert text.endswith("; bare in /bare ended with exit code -9")


def no_answer():
    raise NoAnswerError("waited 90 s in vain for commands: ik_node in / ended with exit code 1")


def test_the_next_row_is_measured_and_the_exit_code_tells(monkeypatch, capsys):
    def figures():
        yield attempt("first", no_answer)
        yield attempt("second", lambda: figure("second", "reference", [1.0], [1.0]))

    monkeypatch.setitem(sys.modules, "benchmarks.bench_start", SimpleNamespace(figures=figures))
    monkeypatch.setattr(sys, "argv", ["benchmarks", "start"])
    assert benchmarks.main() == 1
    printed = capsys.readouterr()
    assert "ik_node in / ended with exit code 1" in printed.out
    assert "| second" in printed.out
    assert "no answer: first: waited 90 s in vain" in printed.err


def test_the_next_table_is_printed(monkeypatch, capsys):
    def in_vain():
        raise TimeoutError("waited 60 s in vain for a motion")

    def printed():
        print("a table")
        return True

    monkeypatch.setitem(sys.modules, "benchmarks.bench_goals", SimpleNamespace(run=in_vain))
    monkeypatch.setitem(sys.modules, "benchmarks.growth", SimpleNamespace(run=printed))
    monkeypatch.setattr(sys, "argv", ["benchmarks", "goals", "growth"])
    assert benchmarks.main() == 1
    output = capsys.readouterr()
    assert "a table" in output.out
    assert "no answer: goals: waited 60 s in vain for a motion" in output.err


def test_what_is_not_installed_is_no_failure(monkeypatch, capsys):
    rows = [Missing("sweep", "pylinkage is not installed")]
    module = SimpleNamespace(figures=lambda: iter(rows))
    monkeypatch.setitem(sys.modules, "benchmarks.bench_start", module)
    monkeypatch.setattr(sys, "argv", ["benchmarks", "start"])
    assert benchmarks.main() == 0
    assert "pylinkage is not installed" in capsys.readouterr().out
