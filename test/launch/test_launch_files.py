"""ROS 2's launch is not among the wheels, so its files are read, not run."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tri_glide_kinematics.nodes.fk_node import AllJointStates
from tri_glide_kinematics.settings import FK_NODE

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "launch").glob("*.launch.py"))
NAMES = [file.name for file in FILES]


def calls(file: Path, function: str) -> Iterator[ast.Call]:
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == function:
            yield node


def texts(node: ast.AST) -> set[str]:
    return {
        part.value
        for part in ast.walk(node)
        if isinstance(part, ast.Constant) and isinstance(part.value, str)
    }


def keyword(call: ast.Call, name: str) -> ast.expr:
    return next(entry.value for entry in call.keywords if entry.arg == name)


def own_nodes(file: Path) -> Iterator[ast.Call]:
    """The nodes of this package; others have a text for the name of theirs."""
    for call in calls(file, "Node"):
        if not isinstance(keyword(call, "package"), ast.Constant):
            yield call


def test_there_is_one_for_the_machine_and_one_with_mechanisms():
    assert NAMES == ["tri_glide.launch.py", "tri_glide_and_mechanisms.launch.py"]


@pytest.mark.parametrize("file", FILES, ids=NAMES)
def test_it_compiles_and_has_the_function_that_ros_calls(file):
    tree = ast.parse(file.read_text(encoding="utf-8"))
    compile(tree, file.name, "exec")
    functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    assert "generate_launch_description" in functions


@pytest.mark.parametrize("file", FILES, ids=NAMES)
def test_the_executables_exist(file):
    named = set()
    for call in [*own_nodes(file), *calls(file, "_node"), *calls(file, "ExecutableInPackage")]:
        for value in (*call.args, *(k.value for k in call.keywords if k.arg == "executable")):
            if isinstance(value, ast.Constant):
                named.add(value.value)
    assert named
    for name in named:
        assert (ROOT / "executables" / name).is_file(), name


@pytest.mark.parametrize("file", FILES, ids=NAMES)
def test_the_files_exist(file):
    for call in calls(file, "PathJoinSubstitution"):
        *folders, name = (part for part in ast.walk(call.args[0]) if isinstance(part, ast.Constant))
        path = ROOT.joinpath(*(part.value for part in folders), name.value)
        assert path.is_file(), path


def test_each_argument_has_a_default_and_a_description_and_is_used():
    file = ROOT / "launch" / "tri_glide.launch.py"
    used = {call.args[0].value for call in calls(file, "LaunchConfiguration")}
    declared = set()
    for call in calls(file, "DeclareLaunchArgument"):
        declared.add(call.args[0].value)
        assert keyword(call, "default_value")
        assert len(keyword(call, "description").value) > 10
    expected = {"simulator", "namespace", "parameters", "calibrated", "transport"}
    assert declared == used == expected | {"description", "rviz"}


def test_the_calibrated_file_comes_behind_the_other_one_and_is_the_same_if_none_is_named():
    """Of two parameter files the later one counts."""
    file = ROOT / "launch" / "tri_glide.launch.py"
    (node,) = own_nodes(file)
    given = [texts(each) for each in keyword(node, "parameters").elts]
    assert given == [{"parameters"}, {"calibrated"}]
    declared = {call.args[0].value: call for call in calls(file, "DeclareLaunchArgument")}
    assert list(declared).index("parameters") < list(declared).index("calibrated")
    assert ast.unparse(keyword(declared["calibrated"], "default_value")) == ast.unparse(
        keyword(node, "parameters").elts[0]
    )


def test_the_state_publisher_gets_the_joints_and_the_urdf_of_the_same_parameter_files():
    file = ROOT / "launch" / "tri_glide.launch.py"
    node = next(call for call in calls(file, "Node") if "robot_state_publisher" in texts(call))
    assert {"joint_states", AllJointStates.TOPIC} <= texts(keyword(node, "remappings"))
    assert texts(keyword(node, "condition")) == {"description", "rviz"}
    (command,) = calls(file, "Command")
    parts = [
        part.value
        for part in ast.walk(command)
        if isinstance(part, ast.Constant) and "'" not in part.value
    ]
    assert parts.index("parameters") < parts.index("calibrated") < parts.index("namespace")


def test_rviz_shows_topics_that_there_are_in_the_frame_of_the_machine():
    view = yaml.safe_load((ROOT / "config" / "tri_glide.rviz").read_text(encoding="utf-8"))
    manager = view["Visualization Manager"]
    (frame,) = (entry.default for entry in FK_NODE if entry.name == "base_frame")
    assert manager["Global Options"]["Fixed Frame"] == frame
    displays = {each["Class"].partition("/")[2]: each for each in manager["Displays"]}
    assert displays["RobotModel"]["Description Topic"]["Value"] == "robot_description"
    assert displays["MarkerArray"]["Topic"]["Value"] == "markers"
    for topic in (displays["RobotModel"]["Description Topic"], displays["MarkerArray"]["Topic"]):
        assert topic["Durability Policy"] == "Transient Local"


def test_the_transports_are_those_that_there_are():
    from tri_glide_kinematics.ros.starting import MEANINGS, VARIABLE

    file = ROOT / "launch" / "tri_glide.launch.py"
    transport = next(
        call for call in calls(file, "DeclareLaunchArgument") if call.args[0].value == "transport"
    )
    assert texts(keyword(transport, "choices")) == set(MEANINGS)
    assert VARIABLE in texts(keyword(transport, "default_value"))
    assert VARIABLE in texts(next(calls(file, "SetEnvironmentVariable")))


@pytest.mark.parametrize("file", FILES, ids=NAMES)
def test_what_is_imported_has_these_names_in_jazzy(file):
    """The modules and names that the launch files use, as launch and launch_ros have them."""
    known = {
        "launch": "LaunchContext LaunchDescription",
        "tri_glide_kinematics.ros.starting": "check_launch",
        "launch.actions": "DeclareLaunchArgument IncludeLaunchDescription OpaqueFunction "
        "SetEnvironmentVariable",
        "launch.conditions": "IfCondition",
        "launch.launch_description_sources": "PythonLaunchDescriptionSource",
        "launch.substitutions": "Command EnvironmentVariable LaunchConfiguration OrSubstitution "
        "PathJoinSubstitution",
        "launch_ros.actions": "Node",
        "launch_ros.parameter_descriptions": "ParameterValue",
        "launch_ros.substitutions": "ExecutableInPackage FindPackageShare",
    }
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert {alias.name for alias in node.names} <= set(known[node.module].split())


def test_what_is_named_and_not_there_stops_the_launch(tmp_path):
    from tri_glide_kinematics.ros.starting import LaunchError, check_launch

    here = tmp_path / "here.yaml"
    here.write_text("")
    check_launch([str(here)], ["rclpy"])
    for missing in (tmp_path / "there.yaml", tmp_path):
        with pytest.raises(LaunchError, match="nothing is started"):
            check_launch([str(here), str(missing)], [])
    with pytest.raises(LaunchError, match="no_such_package is not installed"):
        check_launch([], ["no_such_package"])


def test_it_is_checked_before_anything_starts():
    """And for all that can be named."""
    tree = ast.parse((ROOT / "launch" / "tri_glide.launch.py").read_text(encoding="utf-8"))
    check = next(each for each in tree.body if getattr(each, "name", "") == "_check")
    named = {"parameters", "calibrated", "description", "rviz", "robot_state_publisher", "rviz2"}
    assert named <= texts(check)
    file = ROOT / "launch" / "tri_glide.launch.py"
    (order,) = (call.args[0] for call in calls(file, "LaunchDescription"))
    assert ast.unparse(order) == (
        "[*arguments, OpaqueFunction(function=_check), transport, *nodes]"
    )
    # Of the other launch file the machine comes first, which ends the launch.
    other = ROOT / "launch" / "tri_glide_and_mechanisms.launch.py"
    (order,) = (call.args[0] for call in calls(other, "LaunchDescription"))
    assert ast.unparse(order) == "[machine, mechanisms]"
