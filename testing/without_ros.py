"""For pytest in an environment without ROS: which tests of the package can be run there.

Tests mirror the rooms and modules of the package, and those are run; others are of the repository.
Rooms that may import ROS have some tests that do not: a file of theirs is left out if it imports
something that is not there. In all other rooms that is an error.
"""

from __future__ import annotations

import runpy
from pathlib import Path

import tri_glide_kinematics

TESTS = Path("test").resolve()
PACKAGE = Path(tri_glide_kinematics.__file__).parent
ROOMS_WITH_ROS = {"nodes", "ros"}


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leave out a file or a folder, or say nothing of it."""
    if TESTS not in collection_path.parents:
        return None
    room = collection_path.relative_to(TESTS).parts[0]
    if not (PACKAGE / room.removeprefix("test_")).exists():
        return True
    if room in ROOMS_WITH_ROS and collection_path.name.startswith("test_"):
        try:
            runpy.run_path(str(collection_path))
        except ModuleNotFoundError:
            return True
    return None
