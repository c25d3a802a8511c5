"""Which computer, versions and sources a run belongs to, and what processor time processes take."""

import os
import platform
import subprocess
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("numpy", "ruckig", "ros-jazzy-rclpy", "rclpy", "pylinkage", "numba")


def description() -> str:
    """Return what a reader needs to judge a run, one line each."""
    return "\n".join(
        (
            f"machine:  {processor()}, {os.cpu_count()} cores, {memory():.0f} GB, "
            f"{platform.system()} {platform.release()}",
            f"load:     {' '.join(f'{load:.2f}' for load in os.getloadavg())} (1, 5, 15 minutes)",
            f"versions: Python {platform.python_version()}, {', '.join(versions())}, {compiler()}",
            f"sources:  {git_state()}",
        )
    )


def processor() -> str:
    """Return the model of the processor."""
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def memory() -> float:
    """Return the size of the memory [GB]."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9


def processor_time(pid: int) -> int:
    """Return the processor time of all threads of a process [ns]."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks)


def versions() -> list[str]:
    """Return the installed packages that matter, with their versions."""
    found = []
    for package in PACKAGES:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return found


def compiler() -> str:
    """Return the version of the C compiler."""
    return _first_line(("cc", "--version")) or "no C compiler"


def git_state() -> str:
    """Return the commit, and whether files differ from it."""
    git = ("git", "-C", str(ROOT))
    commit = _first_line((*git, "rev-parse", "--short=12", "HEAD"))
    if not commit:
        return "not a git checkout"
    folders = ("tri_glide_kinematics", "benchmarks")
    changed = _output((*git, "status", "--porcelain", "--", *folders)).splitlines()
    return f"commit {commit}, " + (f"{len(changed)} files changed" if changed else "clean")


def _first_line(command: Sequence[str]) -> str:
    return next(iter(_output(command).splitlines()), "")


def _output(command: Sequence[str]) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout
    except FileNotFoundError:
        return ""
