"""Arguments of a node: those that have no meaning are named, with the right one beside them."""

import pytest

from tri_glide_kinematics.settings import NODES, check_arguments, help_text, help_wanted, in_words
from tri_glide_kinematics.settings.arguments import ArgumentError, parameter_files, parameter_rules


@pytest.mark.parametrize(
    "arguments",
    [
        "",
        "--ros-args",
        "--ros-args -p rate:=500.0 -r __ns:=/cell_1 --params-file a.yaml",
        "--ros-args -p rate:=500.0 --",
        "--ros-args -p rate:=500.0 -- --ros-args --log-level debug",
        "--ros-args --whatever-ros-may-know-one-day",
    ],
)
def test_ros_arguments_are_left_to_ros(arguments):
    check_arguments("ik_node", arguments.split())


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (
            "--params-file a.yaml",
            "unknown argument '--params-file': ROS arguments stand behind --ros-args: "
            "ik_node --ros-args --params-file",
        ),
        ("rate:=500.0", "behind --ros-args"),
        ("--ros-arg -p rate:=500.0", "'--ros-arg': did you mean --ros-args?"),
        ("--hepl", "did you mean --help?"),
        ("fast", "'fast': a node takes ROS arguments only; see ik_node --help"),
        ("--ros-args -p rate:=500.0 -- fast", "unknown argument 'fast'"),
        ("--ros-args -p rate=500.0", "-p 'rate=500.0' is not of the form NAME:=VALUE"),
        ("--ros-args --param rate:=", "--param 'rate:=' is not of the form NAME:=VALUE"),
        ("--ros-args -r __ns=/a", "-r '__ns=/a' is not of the form FROM:=TO"),
    ],
)
def test_arguments_without_a_meaning_are_named(arguments, reason):
    with pytest.raises(ArgumentError) as raised:
        check_arguments("ik_node", arguments.split())
    assert reason in str(raised.value)


def test_parameters_are_found_among_the_arguments():
    arguments = "--ros-args -p a:=1 --params-file x --param n:b:=2 -r c:=d --params-file y".split()
    assert parameter_files(arguments) == ["x", "y"]
    assert parameter_rules(arguments) == ["a:=1", "n:b:=2"]
    assert parameter_files(["--ros-args", "--params-file"]) == []
    assert parameter_rules(["-p", "no:cacheprovider", "--ros-args", "-p", "a:=1"]) == ["a:=1"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "['--params-fil', 'x']",
            "unknown ROS argument '--params-fil': did you mean --params-file?",
        ),
        ("['-params-file']", "unknown ROS argument '-params-file': did you mean --params-file?"),
        ("['fast']", "unknown ROS argument 'fast'"),
        (
            "failed to initialize rcl: Couldn't parse trailing -p flag., at /a/b.c:356",
            "Couldn't parse trailing -p flag.",
        ),
    ],
)
def test_errors_of_ros_are_one_line_without_its_source(text, words):
    assert in_words(RuntimeError(text), []) == words


@pytest.mark.parametrize(
    ("values", "is_told"),
    [
        ("[1, 0.5, 1]", True),
        ("[1.0, 0.5, 1.0]", False),
        ("[1, 2, 1]", False),
        ("[1.0, a]", False),
        ("&a [*a, 1]", False),
        ("[1, 0.5", False),
    ],
)
def test_arrays_of_two_types_get_advice(values, is_told, tmp_path):
    rule = ["--ros-args", "-p", f"velocity_limits:={values}"]
    assert ("[1.0, 0.5, 1.0]" in in_words(RuntimeError("no"), rule)) is is_told
    path = tmp_path / "limits.yaml"
    path.write_text(f"/**:\n  ros__parameters:\n    velocity_limits: {values}\n")
    file = ["--ros-args", "--params-file", str(path)]
    assert ("[1.0, 0.5, 1.0]" in in_words(RuntimeError("no"), file)) is is_told


def test_a_parameter_file_that_holds_itself_gets_no_advice(tmp_path):
    path = tmp_path / "circle.yaml"
    path.write_text("/**:\n  ros__parameters: &a\n    velocity_limits: *a\n")
    assert in_words(RuntimeError("no"), ["--ros-args", "--params-file", str(path)]) == "no"


def test_help_says_what_the_node_does_and_takes():
    assert help_wanted(["--help"])
    assert help_wanted(["--ros-args", "-h"])
    assert not help_wanted(["--ros-args", "-p", "a:=1"])
    for name, table in NODES.items():
        text = help_text(name, "Tells where the platform is.", table)
        for part in (f"{name} [--ros-args ...]", "Tells where", "--params-file FILE", "__ns:="):
            assert part in text
        for entry in table:
            assert f"  {entry.name} (" in text
    assert "no parameters" in help_text("mechanism_node", "Answers.", ())
