import pytest

from tri_glide_kinematics.ros.other_publishers import UNNAMED, other_publishers

ME = "/cell/ik_node"
COMMANDS, ARRAYS = "/cell/joint_commands", "/cell/forward_command"


@pytest.mark.parametrize("found", [{COMMANDS: [ME]}, {COMMANDS: []}, {}])
def test_alone(found):
    assert other_publishers(ME, {COMMANDS: 1}, found) is None


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ("/cell/other", "/cell/other"),
        (ME, "another /cell/ik_node"),
        # It never becomes known.
        (UNNAMED, "a node of unknown name"),
    ],
)
def test_another_node(other, words):
    assert other_publishers(ME, {COMMANDS: 1}, {COMMANDS: [other, ME]}) == (
        f"{words} publishes /cell/joint_commands as well: end one of them "
        "(one that has died is forgotten within 20 s)"
    )


def test_two_outputs_on_one_topic_are_both_ours():
    assert other_publishers(ME, {COMMANDS: 2}, {COMMANDS: [ME, ME]}) is None
    assert "another" in other_publishers(ME, {COMMANDS: 2}, {COMMANDS: [ME, ME, ME]})


def test_each_other_node_is_named_once_for_each_topic():
    text = other_publishers(
        ME, {COMMANDS: 1, ARRAYS: 1}, {COMMANDS: ["/b", ME, "/a", "/a"], ARRAYS: [ME, "/a"]}
    )
    assert text.startswith(
        "/a publishes /cell/joint_commands, /b publishes /cell/joint_commands, "
        "/a publishes /cell/forward_command as well"
    )
