"""The command ``tri-glide``: help at once, every command by its name, completion; without ROS."""

import signal
import subprocess
import sys

import pytest

from tri_glide_kinematics import __version__
from tri_glide_kinematics.command_line import COMMANDS, completion, main

PROGRAM = "drive program_example.gcode"


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Return a function that runs a command line: it returns exit code, output and errors."""
    handler = signal.getsignal(signal.SIGINT)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.chdir(tmp_path)

    def run(line):
        monkeypatch.setattr(sys, "argv", ["/bin/tri-glide", *line.split()])
        try:
            code = main()
        except SystemExit as end:
            code = end.code
        return code, *capsys.readouterr()

    yield run
    signal.signal(signal.SIGINT, handler)


def test_help_loads_nothing_that_is_large():
    large = ("numpy", "matplotlib", "yaml", "rclpy")
    code = (
        "import sys; from tri_glide_kinematics.command_line import main\n"
        "try: main()\n"
        f"except SystemExit: print([name for name in {large} if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "--help"], capture_output=True, text=True, check=True
    )
    *told, loaded = done.stdout.splitlines()
    assert loaded == "[]"
    for name, command in COMMANDS.items():
        assert any(line.split(maxsplit=1) == [name, command.meaning] for line in told), name


def test_commands_load_numpy_after_they_have_said_how_many_threads_it_may_have():
    """All but drive, which works out no matrices."""
    modules = [command.module for name, command in COMMANDS.items() if name != "drive"]
    names = ", ".join(f"tri_glide_kinematics.{module}" for module in modules)
    code = f"import sys, {names}; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.mark.parametrize("name", COMMANDS)
def test_each_command_tells_how_it_is_called(run, name):
    code, told, _ = run(f"{name} --help")
    assert code == 0
    assert told.startswith(f"usage: tri-glide {name} [-h]")
    code, _, error = run(f"{name} --nonsense")
    assert code == 2
    assert f"\ntri-glide {name}: error: " in error


@pytest.mark.parametrize(
    ("line", "words"), [("", "name a command: calibrate, "), ("nonsense", "choose from ")]
)
def test_a_mistake_is_answered_with_the_names_of_the_commands(run, line, words):
    code, _, error = run(line)
    assert code == 2
    assert words in error


def test_the_version_is_told(run):
    assert run("--version") == (0, f"tri-glide {__version__}\n", "")


def test_an_installed_program_is_checked_without_ros(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    code, told, error = run(f"{PROGRAM} --check")
    assert code == 0, error
    assert "inside the workspace: " in told
    code, _, error = run(PROGRAM)
    assert code == 1
    assert error == (
        "drive: error: the Python module 'rclpy' is missing; without ROS 2 there is --check\n"
    )


@pytest.mark.parametrize(
    ("words", "fitting"),
    [
        (["dr"], ["draw_machine", "draw_mechanism", "draw_motion", "drive"]),
        (["--co"], ["--completion"]),
        (["draw_motion", "a.nc", "--m"], ["--mcap"]),
        (["draw_motion", "--unit", ""], ["m", "mm"]),
        (["ringdown", "--shaper", "z"], ["zv", "zvd"]),
        # Names of files come from the shell.
        (["draw_motion", ""], []),
        (["size", "--write", "m"], []),
    ],
)
def test_bash_completes(tmp_path, words, fitting):
    script = tmp_path / "completion"
    script.write_text(
        f"{completion('bash')}\n"
        'COMP_WORDS=(tri-glide "$@") COMP_CWORD=$#\n'
        '_tri_glide; printf "%s\\n" "${COMPREPLY[@]}"\n'
    )
    done = subprocess.run(["bash", str(script), *words], capture_output=True, text=True, check=True)
    assert done.stdout.split() == fitting


def test_zsh_completes_as_bash_does(run):
    code, told, _ = run("--completion zsh")
    assert code == 0
    before, _, after = told.partition(completion("bash"))
    assert (before.count("bashcompinit"), after) == (2, "")
