"""How the commands that draw end: with a word about what went wrong, and never a traceback."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

PACKAGE = "tri_glide_kinematics"


def find_file(file: Path) -> Path:
    """Return ``file``, or the installed configuration file of that name if there is no such file.

    ROS keeps the folders in which packages are installed in the environment.
    """
    if not file.exists() and file.name == str(file):
        for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
            installed = Path(prefix, "share", PACKAGE, "config", file.name)
            if installed.exists():
                return installed
    return file


def exit_code(name: str, output: Path, work: Callable[[], None]) -> int:
    """Do the ``work`` of a command, and return its exit code.

    Until ``work`` has loaded what it needs, Ctrl-C ends the process at once; then it sets
    ``signal.default_int_handler``.

    Args:
        name: of the command, for its errors.
        output: folder that it writes to.
        work: what it does.

    Returns:
        0 if it is done, 1 after an error, 130 after Ctrl-C.
    """
    handler = signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        from tri_glide_kinematics.errors import KinematicsError

        try:
            work()
        except KinematicsError as error:
            return _fail(name, str(error))
        except OSError as error:
            return _fail(name, f"cannot write to {output}: {error.strerror or error}")
    except ModuleNotFoundError as error:
        return _fail(name, f"the Python module {error.name!r} is missing")
    except KeyboardInterrupt:
        print(f"{name}: interrupted", file=sys.stderr)
        return 128 + signal.SIGINT
    finally:
        signal.signal(signal.SIGINT, handler)
    return 0


def _fail(name: str, message: str) -> int:
    print(f"{name}: error: {message}", file=sys.stderr)
    return 1
