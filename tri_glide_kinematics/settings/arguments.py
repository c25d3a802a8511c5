"""A node refuses to start if anything that it is given would be ignored.

ROS drops without a word what it finds under the name of another node, or under a name that no
parameter has. A machine would then run with the defaults instead. No ROS in here, so that a
misspelt word is found before anything has started.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.keys import yaml_errors, yaml_tree
from tri_glide_kinematics.settings.tables import (
    NODES,
    Parameter,
    ParameterError,
    Values,
    plain_list,
)

RULES = {
    "-p": "NAME:=VALUE",
    "--param": "NAME:=VALUE",
    "-r": "FROM:=TO",
    "--remap": "FROM:=TO",
}
PARAMETER_OPTIONS = ("-p", "--param")
FILE_OPTION = "--params-file"
# Those of ROS, to tell which one a misspelt word stands for. ROS itself decides which are valid.
ROS_OPTIONS = (
    "--ros-args",
    *RULES,
    FILE_OPTION,
    "--enclave",
    "--log-level",
    "--log-config-file",
    "--log-file-name",
    *(
        f"--{verb}-{what}"
        for verb in ("enable", "disable")
        for what in ("rosout-logs", "stdout-logs", "external-lib-logs")
    ),
)
HELP_OPTIONS = ("-h", "--help")

ROS_HELP = """\
behind --ros-args:
  --params-file FILE    parameters, in a section for all nodes (/**), NODE or /NAMESPACE/NODE
  -p NAME:=VALUE        one parameter; it wins over those of a section /**
  -r __ns:=/cell_1      the namespace of the node and its topics
  -r FROM:=TO           another name for a topic or a service; __node:=NAME for the node itself
  --log-level LEVEL     debug, info, warn, error or fatal
"""


class ArgumentError(KinematicsError):
    """A node was started with an argument that has no meaning."""


def help_wanted(arguments: Sequence[str]) -> bool:
    """Return whether the arguments ask for help."""
    return any(argument in HELP_OPTIONS for argument in arguments)


def help_text(node: str, purpose: str, table: Sequence[Parameter]) -> str:
    """Return what ``--help`` prints about a node; its ``purpose`` is a sentence."""
    parameters = f"parameters:\n{plain_list(table)}\n" if table else "It has no parameters.\n"
    return (
        f"usage: ros2 run tri_glide_kinematics {node} [--ros-args ...]\n\n"
        f"{purpose}\n\n{ROS_HELP}\n{parameters}"
    )


def check_arguments(node: str, arguments: Sequence[str]) -> None:
    """Check what can be known about the arguments without ROS.

    Raises:
        ArgumentError: if an argument stands outside of the ROS arguments, of which a node has no
            others, or a rule is not of the form NAME:=VALUE.
    """
    inside, outside = _divided(arguments)
    for argument in outside:
        raise ArgumentError(f"unknown argument {argument!r}{_advice(node, argument)}")
    for option, rule in _values(inside):
        name, _, value = rule.partition(":=")
        if option in RULES and not (name and value):
            raise ArgumentError(f"{option} {rule!r} is not of the form {RULES[option]}")


def parameter_files(arguments: Sequence[str]) -> list[str]:
    """Return the paths of all parameter files."""
    inside, _ = _divided(arguments)
    return [value for option, value in _values(inside) if option == FILE_OPTION]


def parameter_rules(arguments: Sequence[str]) -> list[str]:
    """Return all ``NAME:=VALUE`` that set a parameter."""
    inside, _ = _divided(arguments)
    return [value for option, value in _values(inside) if option in PARAMETER_OPTIONS]


def in_words(error: RuntimeError, arguments: Sequence[str]) -> str:
    """Return why ROS refuses ``arguments``, in one line and without the places in its source."""
    text = str(error)
    # The error names unknown arguments as the text of a list.
    unknown = re.match(r"\['(.*?)'[,\]]", text)
    if unknown:
        return f"unknown ROS argument {unknown[1]!r}{_meant(unknown[1])}"
    text = " ".join(re.sub(r",? at \S+:\d+", "", text).split())
    if _have_mixed_array(arguments):
        text += " (all numbers of an array with a decimal point, or none: [1.0, 0.5, 1.0])"
    return text.removeprefix("failed to initialize rcl: ")


def _have_mixed_array(arguments: Sequence[str]) -> bool:
    """Return whether an array has numbers with a decimal point and others, which ROS refuses."""
    texts = [rule.partition(":=")[2] for rule in parameter_rules(arguments)]
    for path in map(Path, parameter_files(arguments)):
        texts += [path.read_text(encoding="utf-8")] if path.is_file() else []
    for text in texts:
        # An entry that is named may hold itself.
        with suppress(yaml.YAMLError, RecursionError):
            if _is_mixed(yaml.load(text, LOADER)):
                return True
    return False


def _is_mixed(value: object) -> bool:
    if isinstance(value, dict):
        return any(map(_is_mixed, value.values()))
    return isinstance(value, list) and {int, float} <= set(map(type, value))


def _advice(node: str, argument: str) -> str:
    if argument in ROS_OPTIONS or ":=" in argument:
        return f": ROS arguments stand behind --ros-args: {node} --ros-args {argument} ..."
    return _meant(argument) or f": a node takes ROS arguments only; see {node} --help"


def _meant(argument: str) -> str:
    nearest = get_close_matches(argument, (*ROS_OPTIONS, *HELP_OPTIONS), n=1)
    return f": did you mean {nearest[0]}?" if nearest else ""


def _divided(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the arguments of ROS, between ``--ros-args`` and ``--``, and the others."""
    of_ros: list[str] = []
    others: list[str] = []
    part = others
    for argument in arguments:
        if argument == "--ros-args":
            part = of_ros
        elif argument == "--" and part is of_ros:
            part = others
        else:
            part.append(argument)
    return of_ros, others


def _values(ros_arguments: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the options that are of interest here, each with its value."""
    following = iter(ros_arguments)
    for argument in following:
        if argument in RULES or argument == FILE_OPTION:
            value = next(following, None)
            if value is not None:
                yield argument, value


PARAMETERS_OF_ALL = frozenset(entry.name for table in NODES.values() for entry in table)
PARAMETERS_KEY = "ros__parameters"
WILDCARDS = {"/*": r"/\w+", "/**": r"(/\w+)*"}
# The loader of libyaml, which ROS reads the files with, takes a tenth of the time of PyYAML's own.
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# How alike two names are of which one is taken for the other misspelt.
ALIKE = 0.8


class ParameterSource(NamedTuple):
    """A parameter file, or a rule of the command line.

    Attributes:
        name: as the user wrote it.
        sections: full names of the nodes that it is for, with wildcards.
    """

    name: str
    sections: tuple[str, ...]


def sources_of(arguments: Sequence[str]) -> list[ParameterSource]:
    """Return the sources that the command line names.

    Rules for all nodes are left out, and pipes, which can be read but once: by ROS.

    Raises:
        ParameterError: if a file cannot be read, or is no parameter file.
    """
    sources = [
        ParameterSource(path, sections_of(path))
        for path in parameter_files(arguments)
        if not Path(path).is_fifo()
    ]
    for rule in parameter_rules(arguments):
        node, colon, _ = rule.partition(":=")[0].rpartition(":")
        if colon:
            sources.append(ParameterSource(f"-p {rule}", (_full(node),)))
    return sources


@cache
def sections_of(path: str) -> tuple[str, ...]:
    """Return the full names of the nodes that a parameter file has sections for.

    Raises:
        ParameterError: if it cannot be read, is not YAML, has no section, or a key or a section
            stands twice in it.
    """
    sections = tuple(name for name, _ in _sections(_tree_of(path)))
    if not sections:
        raise ParameterError(
            f"parameter file {path} has no section: the name of a node (or /** for all), below it "
            f"{PARAMETERS_KEY}, and below that the parameters"
        )
    twice = [section for section in dict.fromkeys(sections) if sections.count(section) > 1]
    if twice:
        raise ParameterError(f"parameter file {path} has two sections for {', '.join(twice)}")
    return sections


def _tree_of(path: str) -> yaml.Node | None:
    with yaml_errors(path, _file_error):
        return yaml_tree(LOADER(Path(path).read_text(encoding="utf-8")))


def check_sources(sources: Iterable[ParameterSource], node: str) -> list[str]:
    """Check that each source has a section for a node of this full name.

    Returns:
        Warnings: sections that look as if they were for this node, and are not.

    Raises:
        ParameterError: if a source has no section for the node.
    """
    own = node.rpartition("/")[2]
    warnings = []
    for source in sources:
        found = [section for section in source.sections if is_for(section, node)]
        others = [section for section in source.sections if section not in found]
        if not found:
            raise ParameterError(
                f"{source.name} is for {', '.join(others)}, and this node is {node} "
                f"(/**/{own} is {own} in any namespace, /** is every node)"
            )
        named = any(_last(section) == own for section in found)
        alike = [section for section in others if _is_meant_for(own, _last(section))]
        if alike and not named:
            warnings.append(f"{source.name}: {', '.join(alike)} is not this node, {node}")
    return warnings


def file_values(path: str, node: str, table: Iterable[Parameter], *later: str) -> Values:
    """Return the values that a node has if it starts with this parameter file alone.

    Args:
        path: of the file.
        node: full name of the node.
        table: its parameters.
        later: paths of more files; of two, the later one wins.

    Raises:
        KinematicsError: if the file cannot be read, is not for the node, or a name or a value in it
            has no meaning.
    """
    check_sources([ParameterSource(each, sections_of(each)) for each in (path, *later)], node)
    sections: list[tuple[str, dict[str, Any]]] = []
    for each in (path, *later):
        for section, content in _sections(_tree_of(each)):
            if isinstance(content, yaml.MappingNode):
                # A list for a key, for instance, or a date that is none.
                with yaml_errors(each, _file_error):
                    sections.append((section, LOADER("").construct_document(content)))
    found: dict[str, Any] = {}
    # An entry for a node by its name wins over one for all nodes, in whatever file.
    for section, content in sorted(sections, key=lambda each: "*" not in each[0]):
        if is_for(section, node):
            found |= content
    entries = {entry.name: entry for entry in table}
    check_names(found, entries, PARAMETERS_OF_ALL)
    return {name: entry.checked(found.get(name, entry.default)) for name, entry in entries.items()}


def is_for(section: str, node: str) -> bool:
    """Return whether a section, ``/**/ik_node`` for instance, is for the node of that full name."""
    parts = (WILDCARDS.get(part, re.escape(part)) for part in re.findall(r"/[^/]*", section))
    return re.fullmatch("".join(parts), node) is not None


def check_names(names: Iterable[str], own: Collection[str], known: Collection[str]) -> None:
    """Check that parameters are the node's ``own``, or ``known`` from others that share its files.

    Raises:
        ParameterError: if one is not known; the nearest name is told.
    """
    texts = []
    # A key of YAML may be a number.
    for name in map(str, names):
        if name not in own and name not in known:
            nearest = get_close_matches(name, own, n=1) or get_close_matches(name, known, n=1)
            texts.append(f"{name} (did you mean {nearest[0]}?)" if nearest else name)
    if texts:
        raise ParameterError(f"no such parameter: {', '.join(texts)}; --help lists them")


def _file_error(path: str, place: str, reason: str) -> ParameterError:
    return ParameterError(f"parameter file {path}{place and f', {place}'}: {reason}")


def _sections(node: yaml.Node | None, prefix: str = "") -> Iterator[tuple[str, yaml.Node]]:
    """Yield the full name of each section, and what stands in it."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == PARAMETERS_KEY:
                yield _full(prefix), value
            else:
                yield from _sections(value, f"{prefix}/{str(key.value).strip('/')}")


def _full(name: str) -> str:
    return "/" + name.strip("/")


def _last(section: str) -> str:
    return section.rpartition("/")[2]


def _is_meant_for(own: str, name: str) -> bool:
    """Return whether ``name`` is that of the node, maybe misspelt, and no other node's."""
    return name == own or (name not in NODES and bool(get_close_matches(name, [own], cutoff=ALIKE)))
