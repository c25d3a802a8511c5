"""The demonstration of shapers as a user starts it: a shaper calms each motion."""

from __future__ import annotations

import subprocess
from pathlib import Path

from tri_glide_kinematics.ros.starting import executable

TIMEOUT = 280.0  # s, for what takes 40 s on a computer that does nothing else


def test_a_shaper_calms_each_motion(ros_domain: int, tmp_path: Path) -> None:
    demo = subprocess.run(
        [str(executable("calm_demo")), "--output", str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=TIMEOUT,
    )
    assert demo.returncode == 0, demo.stdout
    assert "calm, and sooner there" in demo.stdout
    rows = [line.split()[:2] for line in demo.stdout.splitlines()]
    for motion in ("move", "path", "stop"):
        assert [motion, "none"] in rows
        assert [motion, "ei"] in rows
    assert (tmp_path / "calm_demo.png").read_bytes().startswith(b"\x89PNG")
