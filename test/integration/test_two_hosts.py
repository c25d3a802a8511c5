"""ik_node and simulator_node on two hosts: network namespaces that an ordinary user may make."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

NAMESPACES = ("unshare", "--user", "--map-root-user", "--net", "--mount")
PROBE = (
    "mount -t tmpfs none /run && ip netns add probe"
    " && ip link add probe0 type veth peer probe1 netns probe"
)
INSIDE = Path(__file__).with_name("two_hosts.py")


def test_cable_between_two_hosts_is_cut_in_mid_motion():
    try:
        probe = subprocess.run(
            [*NAMESPACES, "sh", "-c", PROBE], capture_output=True, text=True, timeout=30.0
        )
        refusal = probe.stderr if probe.returncode else ""
    except FileNotFoundError as error:
        refusal = str(error)
    if refusal:
        pytest.skip(f"network namespaces are not allowed here, nothing was tested: {refusal}")
    run = subprocess.run(
        [*NAMESPACES, sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(INSIDE)],
        capture_output=True,
        text=True,
        timeout=300.0,
        # Arguments for this run of pytest are not for that one.
        env={key: value for key, value in os.environ.items() if key != "PYTEST_ADDOPTS"},
        cwd=Path(__file__).parents[2],
    )
    assert run.returncode == 0, run.stdout + run.stderr
    assert "1 passed" in run.stdout
