"""A ROS domain for tests that make their own nodes, without those of ``test/integration``."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from rclpy.context import Context

from testing.domain import own_context, own_domain, set_transport
from tri_glide_kinematics.ros.starting import COMPUTER


@contextmanager
def joined_domain() -> Iterator[Context]:
    """Join a domain that no other test run uses, on the loopback address alone."""
    with own_domain(), pytest.MonkeyPatch.context() as patch:
        set_transport(patch, COMPUTER)
        with own_context() as context:
            yield context
