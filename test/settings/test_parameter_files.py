"""Parameter files and rules: what would be dropped without a word is refused with one."""

import os

import pytest

from tri_glide_kinematics.settings import (
    IK_NODE,
    ParameterError,
    check_names,
    check_sources,
    file_values,
    is_for,
    sections_of,
    sources_of,
)
from tri_glide_kinematics.settings.arguments import ParameterSource

PARAMETERS = "ros__parameters: {rate: 500.0}"


@pytest.fixture
def write(tmp_path):
    def write_file(text: str) -> str:
        path = tmp_path / "parameters.yaml"
        path.write_text(text)
        return str(path)

    return write_file


@pytest.mark.parametrize(
    ("text", "sections"),
    [
        (f"/**:\n  {PARAMETERS}", ("/**",)),
        (f"ik_node:\n  {PARAMETERS}", ("/ik_node",)),
        (f"/a/b:\n  {PARAMETERS}\n/**/fk_node:\n  {PARAMETERS}", ("/a/b", "/**/fk_node")),
        (f"cell_1:\n  a:\n    ik_node:\n      {PARAMETERS}", ("/cell_1/a/ik_node",)),
        ("/**:\n  ros__parameters:\n    day: 2020-99-99", ("/**",)),
    ],
)
def test_sections_are_full_names(write, text, sections):
    assert sections_of(write(text)) == sections


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "has no section"),
        ("rate: 500.0", "has no section"),
        ("/**:\n  ros_parameters:\n    rate: 500.0", "ros__parameters"),
        ("/**:\n  ros__parameters:\n    a: [1, 2\n", "line 4, column 1"),
        (
            "/**:\n  ros__parameters:\n    a: 5\n    a: 6\n",
            ", lines 3 and 4: the key 'a' stands twice",
        ),
        (f"a:\n  {PARAMETERS}\na:\n  {PARAMETERS}", ", lines 1 and 3: the key 'a' stands twice"),
        (f"ik_node:\n  {PARAMETERS}\n/ik_node:\n  {PARAMETERS}", "two sections for /ik_node"),
        ("/**: {\n", "line 2, column 1"),
        ("\t/**:\n", "line 1, column 1"),
        ("\x00", "not allowed"),
    ],
)
def test_what_is_no_parameter_file_is_refused(write, text, reason):
    path = write(text)
    with pytest.raises(ParameterError) as raised:
        sections_of(path)
    assert path in str(raised.value)
    assert reason in str(raised.value)
    assert "\n" not in str(raised.value)


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(ParameterError, match=r"nowhere\.yaml: cannot be read: No such"):
        sections_of("nowhere.yaml")
    with pytest.raises(ParameterError, match="Is a directory"):
        sections_of(str(tmp_path))
    binary = tmp_path / "binary"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ParameterError, match="codec can't decode"):
        sections_of(str(binary))


def test_sources_are_files_and_rules_for_one_node(write, tmp_path):
    path = write(f"ik_node:\n  {PARAMETERS}")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    arguments = ["--ros-args", "--params-file", path, "-p", "a:=1", "-p", "fk_node:b:=x:y"]
    arguments += ["--params-file", str(pipe)]
    assert sources_of(arguments) == [
        ParameterSource(path, ("/ik_node",)),
        ParameterSource("-p fk_node:b:=x:y", ("/fk_node",)),
    ]


def source(*sections):
    return [ParameterSource("file", sections)]


@pytest.mark.parametrize(
    ("sections", "node"),
    [
        (("/**",), "/cell_1/ik_node"),
        (("/fk_node", "/ik_node"), "/ik_node"),
        (("/cell_2/ik_node", "/cell_1/ik_node"), "/cell_1/ik_node"),
        (("/**", "/fk_node", "/simulator_node"), "/ik_node"),
        (("/**", "/controller_manager"), "/ik_node"),
    ],
)
def test_files_for_several_nodes_are_fine(sections, node):
    assert check_sources(source(*sections), node) == []


@pytest.mark.parametrize(
    ("sections", "node"),
    [
        (("/ik_nod",), "/ik_node"),
        (("/ik_node",), "/cell_1/ik_node"),
        (("/cell_1/ik_node", "/cell_2/ik_node"), "/ik_node"),
        (("/simulator_node", "/fk_node"), "/ik_node"),
        (("/ik_node",), "/arm"),
    ],
)
def test_a_source_that_is_for_others_only_is_refused(sections, node):
    with pytest.raises(ParameterError) as raised:
        check_sources(source("/**") + source(*sections), node)
    for text in (*sections, f"this node is {node} "):
        assert text in str(raised.value)


@pytest.mark.parametrize(
    ("section", "node"), [("/ik_nod", "/ik_node"), ("/ik_node", "/cell_1/ik_node")]
)
def test_a_section_that_looks_like_the_nodes_own_is_told(section, node):
    warnings = check_sources(source("/**", section), node)
    assert warnings == [f"file: {section} is not this node, {node}"]


@pytest.mark.parametrize("name", ["speed_scale", "lag"])
def test_parameters_of_any_node_are_known(name):
    check_names([name], ["speed_scale"], ["speed_scale", "lag"])


def test_unknown_parameters_are_named_with_the_nearest():
    with pytest.raises(ParameterError) as raised:
        check_names(["speed_scal", "lags", "volume"], ["speed_scale"], ["speed_scale", "lag"])
    assert str(raised.value) == (
        "no such parameter: speed_scal (did you mean speed_scale?), lags (did you mean lag?), "
        "volume; --help lists them"
    )


def test_a_name_is_no_pattern():
    assert not is_for("/ik.node", "/ik_node")


def test_values_of_a_file_are_checked_and_defaults_complete_them(write):
    text = "/**:\n  ros__parameters: {rate: 250, space: box}\n"
    own = "/**/ik_node:\n  ros__parameters: {rate: 100.0, lag: 0.01}\n"
    named = "ik_node:\n  ros__parameters: {rate: 50.0}\n"
    others = "/**/fk_node:\n  ros__parameters: {rate: 1.0}\n"
    # What stands for a node by its name wins, wherever it stands.
    values = file_values(write(named + text + own + others), "/ik_node", IK_NODE)
    assert (values["rate"], values["space"]) == (50.0, "box")
    defaults = {entry.name: entry.default for entry in IK_NODE}
    assert values == {**defaults, "rate": 50.0, "space": "box"}
    assert file_values(write(text), "/ik_node", IK_NODE)["rate"] == 250.0


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("/**:\n  ros__parameters: {rates: 5.0}\n", "did you mean rate?"),
        ("/**:\n  ros__parameters: {rate: fast}\n", "rate = 'fast' must be a double"),
        ("/**/fk_node:\n  ros__parameters: {rate: 5.0}\n", "this node is /ik_node"),
    ],
)
def test_a_file_with_values_that_mean_nothing_is_refused(write, text, reason):
    with pytest.raises(ParameterError, match=reason):
        file_values(write(text), "/ik_node", IK_NODE)
