"""The sources of parameters, and whether all of them come to a node. No ROS in here.

ROS drops without a word what it finds under the name of another node, or under a name that no
parameter has. A machine would then run with the defaults instead.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import NamedTuple

import yaml

from tri_glide_kinematics.keys import DuplicateKeyError, yaml_tree
from tri_glide_kinematics.ros.parameters.command_line import parameter_files, parameter_rules
from tri_glide_kinematics.ros.parameters.table import ParameterError
from tri_glide_kinematics.ros.parameters.tables import NODES

PARAMETERS_KEY = "ros__parameters"
WILDCARDS = {"/*": r"/\w+", "/**": r"(/\w+)*"}
# Where PyYAML has libyaml, which ROS reads the files with, that takes a tenth of the time.
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
    try:
        document = yaml_tree(LOADER(Path(path).read_text(encoding="utf-8")))
    except OSError as error:
        raise ParameterError(f"parameter file {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ParameterError(f"parameter file {path} is not text: {error}") from error
    except DuplicateKeyError as error:
        raise ParameterError(f"parameter file {path}, {error.place}: {error}") from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = f", line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise ParameterError(f"parameter file {path}{place}: {error.problem}") from error
    except yaml.YAMLError as error:
        raise ParameterError(f"parameter file {path}: {' '.join(str(error).split())}") from error
    sections = tuple(_sections(document, ""))
    if not sections:
        raise ParameterError(
            f"parameter file {path} has no section: the name of a node (or /** for all), below it "
            f"{PARAMETERS_KEY}, and below that the parameters"
        )
    twice = [section for section in dict.fromkeys(sections) if sections.count(section) > 1]
    if twice:
        raise ParameterError(f"parameter file {path} has two sections for {', '.join(twice)}")
    return sections


def check_sources(sources: Iterable[ParameterSource], node: str) -> list[str]:
    """Check that each source has a section for a node.

    Args:
        sources: of parameters.
        node: full name of the node.

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


def is_for(section: str, node: str) -> bool:
    """Return whether a section, ``/**/ik_node`` for instance, is for the node of that full name."""
    parts = (WILDCARDS.get(part, re.escape(part)) for part in re.findall(r"/[^/]*", section))
    return re.fullmatch("".join(parts), node) is not None


def check_names(names: Iterable[str], own: Collection[str], known: Collection[str]) -> None:
    """Check that parameters exist.

    Args:
        names: of the parameters that were set.
        own: names of the node's parameters.
        known: names of the parameters of all nodes that share their files.

    Raises:
        ParameterError: if one is not known; the nearest name is told.
    """
    texts = []
    for name in names:
        if name not in own and name not in known:
            nearest = get_close_matches(name, own, n=1) or get_close_matches(name, known, n=1)
            texts.append(f"{name} (did you mean {nearest[0]}?)" if nearest else name)
    if texts:
        raise ParameterError(f"no such parameter: {', '.join(texts)}; --help lists them")


def _sections(node: yaml.Node | None, prefix: str) -> Iterator[str]:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == PARAMETERS_KEY:
                yield _full(prefix)
            else:
                yield from _sections(value, f"{prefix}/{str(key.value).strip('/')}")


def _full(name: str) -> str:
    return "/" + name.strip("/")


def _last(section: str) -> str:
    return section.rpartition("/")[2]


def _is_meant_for(own: str, name: str) -> bool:
    """Return whether ``name`` is that of the node, maybe misspelt, and no other node's."""
    return name == own or (name not in NODES and bool(get_close_matches(name, [own], cutoff=ALIKE)))
