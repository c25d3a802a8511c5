"""The command ``tri-glide``: all commands that need no ROS, each by its name.

They are the same that ``ros2 run tri_glide_kinematics NAME`` starts. The module of a command is
imported when it is asked for, so that help is there at once.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from importlib import import_module
from types import ModuleType
from typing import NamedTuple

from tri_glide_kinematics import __version__

PROGRAM = "tri-glide"


class Command(NamedTuple):
    """A command: its module has ``main`` and ``make_parser``; one line says what it does."""

    module: str
    meaning: str


# Modules of commands that are not in the room ``commands``.
ELSEWHERE = {"draw_mechanism": "mechanisms.pictures.command"}

COMMANDS = {
    name: Command(ELSEWHERE.get(name, f"commands.{name}"), meaning)
    for name, meaning in (
        ("calibrate", "find the true geometry of a machine from measurements"),
        ("convert", "settings of Klipper, Marlin, RepRapFirmware to a parameter file, and back"),
        ("describe_machine", "a machine as URDF for RViz and as MJCF for MuJoCo"),
        ("draw_machine", "maps of a machine, and the surface of its workspace"),
        ("draw_mechanism", "pictures of a four-bar linkage or an F-mechanism"),
        ("draw_motion", "the motion of a program, of points or a drive file, as a picture"),
        ("drive", "with --check: prove a program or points; to drive them needs ROS 2"),
        ("identify", "masses and friction from the efforts of the drives"),
        ("judge", "tell whether recorded setpoints keep all limits"),
        ("ringdown", "find the modes of a machine from recordings of its swings"),
        ("simulated_drives", "three servo drives on CAN (CiA 402), behind a pseudo-terminal"),
        ("size", "from what a machine has to do to its lengths and motors"),
    )
}

# Words that complete a command line: what has come, and what fits there. Where no word fits, the
# shell completes names of files.
BASH = """\
_tri_glide() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} words=
    if ((COMP_CWORD == 1)); then
        words="{commands}"
    else
        case "${{COMP_WORDS[1]}} ${{COMP_WORDS[COMP_CWORD - 1]}} $word" in
{cases}
        esac
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _tri_glide {program}
"""
ZSH = "autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n"


def main() -> int:
    """Run the command that the command line names, and return its exit code."""
    # While modules are still being loaded, Ctrl-C just ends the process.
    signal.signal(signal.SIGINT, lambda *_: os._exit(128 + signal.SIGINT))
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if name in COMMANDS:
        # Help and errors name the program as it was called.
        sys.argv = [f"{PROGRAM} {name}", *sys.argv[2:]]
        return int(_module(name).main())
    parser = make_parser()
    options = parser.parse_args()
    if options.completion is None:
        parser.error(f"name a command: {', '.join(COMMANDS)}")
    print(completion(options.completion), end="")
    return 0


def make_parser() -> argparse.ArgumentParser:
    """Return what reads a command line that begins with no known command."""
    widest = max(map(len, COMMANDS))
    parser = argparse.ArgumentParser(
        prog=PROGRAM,
        description="Mathematics, motion and calibration of tri-glide robots; needs no ROS.",
        epilog="commands:\n"
        + "\n".join(f"  {name:{widest}}  {each.meaning}" for name, each in COMMANDS.items())
        + f"\n\n{PROGRAM} COMMAND --help tells more about each",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("command", nargs="?", choices=tuple(COMMANDS), metavar="COMMAND ...")
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    parser.add_argument(
        "--completion",
        choices=("bash", "zsh"),
        help=f'print what completes command lines: eval "$({PROGRAM} --completion bash)"',
    )
    return parser


def completion(shell: str) -> str:
    """Return the script that lets a ``shell``, bash or zsh, complete command lines."""
    cases = []
    for name in COMMANDS:
        # argparse has no public name for what a parser knows.
        actions = _module(name).make_parser()._actions
        for action in actions:
            for option in action.option_strings if action.choices else ():
                cases.append(f'"{name} {option} "*) words="{" ".join(action.choices)}" ;;')
        options = " ".join(option for action in actions for option in action.option_strings)
        cases.append(f'"{name} "*" -"*) words="{options}" ;;')
    own = " ".join(option for action in make_parser()._actions for option in action.option_strings)
    script = BASH.format(
        program=PROGRAM,
        commands=" ".join([*COMMANDS, own]),
        cases="\n".join(f"            {case}" for case in cases),
    )
    return script if shell == "bash" else ZSH + script


def _module(name: str) -> ModuleType:
    return import_module(f"tri_glide_kinematics.{COMMANDS[name].module}")


if __name__ == "__main__":
    sys.exit(main())
