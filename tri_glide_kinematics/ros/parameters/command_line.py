"""The arguments of a node: they are checked, and a wrong one is explained.

No ROS in here, so that a misspelt word is found before anything has started.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.ros.parameters.table import Parameter, plain_list

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
    """Return what ``--help`` prints.

    Args:
        node: its name.
        purpose: what it does, in a sentence.
        table: its parameters.
    """
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


def in_words(error: RuntimeError) -> str:
    """Return why ROS refuses the arguments, in one line and without the places in its source."""
    text = str(error)
    # What it does not know comes as the text of a list.
    unknown = re.match(r"\['(.*?)'[,\]]", text)
    if unknown:
        return f"unknown ROS argument {unknown[1]!r}{_meant(unknown[1])}"
    text = " ".join(re.sub(r",? at \S+:\d+", "", text).split())
    if "should be of same type" in text:
        text += " (all numbers of an array with a decimal point, or none: [1.0, 0.5, 1.0])"
    return text.removeprefix("failed to initialize rcl: ")


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
