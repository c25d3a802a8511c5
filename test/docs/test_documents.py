"""What the documents say is what is there: links, code, commands, names."""

import re
from importlib import import_module
from importlib.util import find_spec
from itertools import chain, pairwise
from pathlib import Path

import matplotlib
import pytest
import yaml
from documents import PAGES, ROOT, anchors, blocks, commands, prose, text
from message_filling import filled, interface

from tri_glide_kinematics.command_line import COMMANDS, PROGRAM
from tri_glide_kinematics.commands.drive import check_on_machine
from tri_glide_kinematics.programs import is_program, load_program, load_settings
from tri_glide_kinematics.settings import tables as parameters

PACKAGE = "tri_glide_kinematics"
IDS = [str(page.relative_to(ROOT)) for page in PAGES]
NODE_SOURCES = "".join(
    path.read_text(encoding="utf-8")
    for folder in ("nodes", "ros")
    for path in (ROOT / PACKAGE / folder).rglob("*.py")
)
TABLES = {
    name: {parameter.name: parameter for parameter in table}
    for name, table in parameters.NODES.items()
}
MADE = ("build/", "install/", "out/")  # what make makes
each_page = pytest.mark.parametrize("page", PAGES, ids=IDS)


def test_the_page_of_parameters_is_that_of_the_tables():
    assert text(ROOT / "docs" / "parameters.md") == parameters.document() + "\n"


@each_page
def test_every_link_and_picture_leads_somewhere(page):
    for target, anchor in re.findall(r"\]\(([^)#:]*)(?:#([^):]*))?\)", prose(page)):
        file = page.parent / target if target else page
        assert file.exists(), target
        if anchor:
            assert anchor in anchors(file), f"{target}#{anchor}"


@each_page
def test_every_named_path_exists(page):
    named = re.findall(r"`((?:[a-z_]+/)*[a-z_]+\.(?:py|yaml|xml|md))`", text(page))
    named += re.findall(r"\b(config/\w+\.\w+)", text(page))
    for name in named:
        if name.startswith(MADE):
            continue
        inside = chain.from_iterable((ROOT / room).rglob(name) for room in (PACKAGE, "benchmarks"))
        assert (ROOT / name).exists() or any(inside), name


@each_page
def test_every_named_folder_exists(page):
    for name in re.findall(r"`((?:[a-z_]+/)+)`", text(page)):
        inside = (ROOT / PACKAGE).rglob(name)
        assert (ROOT / name).is_dir() or name in MADE or any(inside), name


@each_page
def test_python_blocks_run(page):
    matplotlib.use("Agg")
    for code in blocks(page, "python"):
        exec(compile(code, page.name, "exec"), {})


@each_page
def test_every_named_type_exists(page):
    for name in re.findall(r"\b([a-z]\w*/(?:msg|srv|action)/[A-Z]\w*)", text(page)):
        interface(name)


def test_executables_exist():
    named = [words[1] for words in commands("ros2 run") if words[0] == PACKAGE]
    assert {"simulator_node", "ik_node", "fk_node", "mechanism_node"} <= set(named)
    for name in named:
        assert (ROOT / "executables" / name).is_file(), name


def test_commands_without_ros_have_the_options_that_they_are_given():
    found = [words for words in commands(PROGRAM) if words[0] in COMMANDS]
    assert {words[0] for words in found} == set(COMMANDS)
    for name, *arguments in found:
        module = import_module(f"{PACKAGE}.{COMMANDS[name].module}")
        module.make_parser().parse_args(arguments)


def test_launch_files_and_their_arguments_exist():
    found = list(commands("ros2 launch"))
    assert found
    declared = text(ROOT / "launch" / "tri_glide.launch.py")
    for package, file, *arguments in found:
        assert package == PACKAGE
        assert (ROOT / "launch" / file).is_file(), file
        for argument in arguments:
            name = argument.partition(":=")[0]
            assert f'"{name}"' in declared, name


def test_options_of_nodes_name_parameters_and_files():
    for package, node, *words in commands("ros2 run"):
        if package != PACKAGE or node not in TABLES:
            continue
        assert words[0] == "--ros-args"
        for option, value in pairwise(words):
            name = value.partition(":=")[0]
            if option == "-p":
                assert name in TABLES[node], name
            elif option == "-r":
                assert name.startswith("__") or f'"{name}"' in NODE_SOURCES, name
            elif option == "--params-file" and not value.startswith(MADE):
                assert (ROOT / "config" / value.rpartition("/")[2]).is_file(), value


def test_drawn_mechanisms_have_a_file():
    for package, executable, *words in commands("ros2 run"):
        if (package, executable) == (PACKAGE, "draw_mechanism") and not words[0].startswith(MADE):
            assert (ROOT / "config" / words[0]).is_file(), words[0]


def test_driven_programs_are_there_and_what_is_told_about_them_is_so():
    files = {words[2] for words in commands("ros2 run") if words[:2] == [PACKAGE, "drive"]}
    programs = [ROOT / "config" / name for name in files if is_program(Path(name))]
    assert programs
    values = {entry.name: entry.default for entry in parameters.IK_NODE}
    for file in programs:
        program = load_program(file, load_settings(ROOT / "config" / "program_settings.yaml"))
        told = check_on_machine(program, values)
        line = f"{program.lines} lines, inside the workspace: {told.duration:.2f} s, "
        assert f"{file.name}: {line}{1000.0 * told.length:.1f} mm" in text(
            ROOT / "docs" / "driving.md"
        )


def test_published_messages_fit_their_types():
    found = list(commands("ros2 topic pub"))
    assert found
    for *_, topic, kind, content in found:
        assert f'"{topic}"' in NODE_SOURCES, topic
        filled(interface(kind)(), content)


def test_watched_topics_are_published():
    echoed = [words[-1].replace("ik_node/", "~/") for words in commands("ros2 topic echo")]
    recorded = (words[words.index("--topics") + 1 :] for words in commands("ros2 bag"))
    topics = [topic[1:].replace("ik_node/", "~/") for topic in chain(*recorded)]
    assert echoed
    assert topics
    for topic in (*echoed, *topics):
        assert f'"{topic}"' in NODE_SOURCES, topic


def test_requests_fit_the_services():
    found = list(commands("ros2 service call"))
    assert found
    for service, kind, *content in found:
        _, node, name = service.split("/")
        assert (ROOT / "executables" / node).is_file(), node
        assert re.search(rf'"(~/)?{name}"', NODE_SOURCES), service
        filled(interface(kind).Request(), *(content or ["{}"]))


def test_goals_fit_the_actions():
    found = list(commands("ros2 action send_goal"))
    assert found
    for *options, action, kind, content in found:
        assert options == ["--feedback"]
        _, node, name = action.split("/")
        assert (ROOT / "executables" / node).is_file(), node
        assert f'"~/{name}"' in NODE_SOURCES, action
        filled(interface(kind).Goal(), content)


def test_parameters_that_are_set_are_live():
    found = list(commands("ros2 param set"))
    assert found
    for node, name, value in found:
        parameter = TABLES[node[1:]][name]
        assert parameter.live
        parameter.checked(yaml.safe_load(value))


def test_targets_of_make_exist():
    targets = set(re.findall(r"^([a-z-]+):", text(ROOT / "Makefile"), flags=re.MULTILINE))
    named = {target for page in PAGES for target in re.findall(r"`make ([a-z-]+)`", text(page))}
    assert named | {words[0] for words in commands("make")} <= targets


@each_page
def test_named_modules_exist(page):
    named = re.findall(r"python -m ((?!pip|pytest)[a-z_.]+[a-z_])", text(page))
    named += re.findall(rf"\b{PACKAGE}(?:\.[a-z_]+)+\b", text(page))
    for name in named:
        assert find_spec(name) is not None, name
