"""Finds files that are installed with the package."""

from __future__ import annotations

import os
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
