"""``scripts/build_wheel.sh`` makes the same bytes of the same files, and few of them."""

import os
import shutil
import subprocess
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[2]
NEEDED = ("scripts", "config", "tri_glide_kinematics", "LICENSE", "package.xml")
NEEDED += ("pyproject.toml", "setup.cfg", "setup.py")
MOST_BYTES = 1_100_000


def build(clone: Path) -> Path:
    """Copy what the wheel is made of, with times and rights of now; return the wheel."""
    for name in NEEDED:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, clone / name, copy_function=shutil.copyfile)
        else:
            shutil.copyfile(ROOT / name, clone / name)
    script = clone / "scripts" / "build_wheel.sh"
    subprocess.run(["bash", str(script), str(clone / "made")], check=True, timeout=120)
    (wheel,) = (clone / "made").iterdir()
    return wheel


@pytest.mark.slow
def test_the_same_files_give_the_same_bytes(tmp_path: Path) -> None:
    wheels = []
    for name, mask in (("a clone", 0o022), ("another", 0o077)):
        (tmp_path / name).mkdir()
        before = os.umask(mask)
        try:
            wheels.append(build(tmp_path / name))
        finally:
            os.umask(before)
    first, second = (wheel.read_bytes() for wheel in wheels)
    assert first == second
    assert len(first) < MOST_BYTES
    names = ZipFile(wheels[0]).namelist()
    assert "tri_glide_kinematics/command_line.py" in names
    assert any(name.endswith("/share/tri_glide_kinematics/config/tri_glide.yaml") for name in names)
    # What would be nothing without ROS.
    assert not [name for name in names if "/panel/" in name or "/launch/" in name]
