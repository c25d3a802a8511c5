"""For pytest in an environment without ROS: which tests of the package can be run there.

Tests mirror the rooms and modules of the package, and those are run; others are of the repository.
A file that imports ROS is left out; if anything else is missing, that is an error.
"""

import runpy
from pathlib import Path
from xml.etree import ElementTree

import tri_glide_kinematics

TESTS = Path("test").resolve()
PACKAGE = Path(tri_glide_kinematics.__file__).parent
# The keys of rosdep for what comes from elsewhere begin with python3-.
ROS = {
    str(element.text)
    for element in ElementTree.parse("package.xml").iter()
    if element.tag in ("exec_depend", "test_depend") and "python3-" not in str(element.text)
}


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    """Leave out a file or a folder, or say nothing of it."""
    if TESTS not in collection_path.parents:
        return None
    room = collection_path.relative_to(TESTS).parts[0]
    if not (PACKAGE / room.removeprefix("test_")).exists():
        return True
    if collection_path.name.startswith("test_"):
        try:
            runpy.run_path(str(collection_path))
        except ModuleNotFoundError as error:
            return (error.name or "").partition(".")[0] in ROS or None
    return None
