"""``scripts/make_env.sh`` says in one line what is missing on a machine."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NEEDED = ("scripts", "env.sh", "requirements.txt", "constraints.txt", "setup.cfg")
TOOLS = ("bash", "cat", "cut", "dirname", "find", "grep", "head", "mkdir", "rm", "sha256sum")
TOOLS += ("ln", "sort", "tail", "uname", "xargs", "make", "cmake", "g++")


@pytest.fixture
def clone(tmp_path: Path) -> Path:
    """A copy of what the script needs, in a folder with a space in its name."""
    folder = tmp_path / "a clone"
    folder.mkdir()
    for name in NEEDED:
        source = ROOT / name
        copy = shutil.copytree if source.is_dir() else shutil.copy
        copy(source, folder / name)
    return folder


@pytest.fixture
def tools(tmp_path: Path) -> Path:
    """A folder with links to the commands of a machine that has everything but a Python."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in TOOLS:
        path = shutil.which(name)
        assert path, f"{name} is needed by this test"
        (folder / name).symlink_to(path)
    return folder


def make_env(clone: Path, tools: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {"PATH": str(tools), "HOME": str(clone), **variables}
    return subprocess.run(
        [str(tools / "bash"), str(clone / "scripts" / "make_env.sh")],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )


def the_error(done: subprocess.CompletedProcess[str]) -> str:
    assert done.returncode != 0
    assert "Traceback" not in done.stdout + done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("env: error: ")
    return lines[0]


def put_python(folder: Path, *lines: str) -> None:
    """Put a script for python3 into ``folder``."""
    script = folder / "python3"
    script.write_text("\n".join([f"#!{folder}/bash", *lines, ""]))
    script.chmod(0o755)


@pytest.mark.parametrize("missing", ["g++", "cmake", "make"])
def test_a_missing_tool_is_named_with_its_package(clone: Path, tools: Path, missing: str) -> None:
    (tools / missing).unlink()
    assert f"{missing} is missing" in the_error(make_env(clone, tools))


def test_a_path_with_letters_outside_ascii_is_told_at_once(clone, tools):
    elsewhere = clone.rename(clone.with_name("Übung"))
    assert "outside ASCII" in the_error(make_env(elsewhere, tools))
    assert not (elsewhere / ".venv").exists()


def test_a_wrong_python_is_named_with_its_version(clone: Path, tools: Path) -> None:
    put_python(tools, '[ "$1" = --version ] && echo "Python 3.9.18" || exit 1')
    error = the_error(make_env(clone, tools))
    assert "no Python 3.10 to 3.13 found" in error
    assert "python3 is Python 3.9.18" in error


def test_an_interpreter_that_was_asked_for_is_not_replaced(clone: Path, tools: Path) -> None:
    (tools / "python3").symlink_to(sys.base_prefix + "/bin/python3")
    error = the_error(make_env(clone, tools, PYTHON="python3.9"))
    assert "PYTHON=python3.9 is not a Python 3.10 to 3.13" in error


def test_a_missing_network_is_said(clone: Path, tools: Path) -> None:
    """The environment gets a link to the pip of this one: to unpack its own takes far longer."""
    # Not by looking for the module: then setuptools would take the older distutils of this process.
    pip = Path(sysconfig.get_path("purelib")) / "pip"
    assert pip.is_dir()
    python = sys.base_prefix + "/bin/python3"
    put_python(
        tools,
        f'[ "$1 $2" = "-m venv" ] || exec {python} "$@"',
        f'{python} -m venv --without-pip "$3"',
        f'ln -s {pip} "$3"/lib/python3*/site-packages/',
    )
    nowhere = {
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_INDEX_URL": "http://127.0.0.1:9/simple",
        "PIP_TIMEOUT": "1",
    }
    error = the_error(make_env(clone, tools, **nowhere))
    assert "the package index cannot be reached" in error
    assert not (clone / ".venv" / "made_from").exists(), "an incomplete .venv must be made anew"


def test_a_second_run_does_nothing() -> None:
    if not (ROOT / "install" / "made_from").exists():
        pytest.fail("run by hand? `make test` makes the environment first")
    before = (ROOT / "install" / "made_from").stat().st_mtime_ns
    done = subprocess.run(
        [str(ROOT / "scripts" / "make_env.sh")], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (ROOT / "install" / "made_from").stat().st_mtime_ns == before
