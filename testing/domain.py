"""A ROS domain of our own, how nodes in it reach each other, and a context that joins it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import domain_coordinator
import rclpy
from rclpy.context import Context

from tri_glide_kinematics.ros.starting import MIDDLEWARE_VARIABLES, VARIABLE, transport_of

if TYPE_CHECKING:
    import pytest

DOMAIN_VARIABLE = "ROS_DOMAIN_ID"


@contextmanager
def own_domain() -> Iterator[int]:
    """Reserve a domain that nobody else on this computer uses, for this process and its nodes."""
    before = os.environ.get(DOMAIN_VARIABLE)
    reserved = domain_coordinator.domain_id()
    domain = reserved.__enter__()
    os.environ[DOMAIN_VARIABLE] = str(domain)
    try:
        yield domain
    finally:
        if before is None:
            del os.environ[DOMAIN_VARIABLE]
        else:
            os.environ[DOMAIN_VARIABLE] = before
        # It must not see an error: it would take some for a domain that is not free, and hide them.
        reserved.__exit__(None, None, None)


@contextmanager
def own_context() -> Iterator[Context]:
    """Join the domain of this process as another participant."""
    context = Context()
    rclpy.init(context=context, args=[])
    try:
        yield context
    finally:
        context.try_shutdown()


def set_transport(patch: pytest.MonkeyPatch, name: str) -> None:
    """Choose a transport, whatever the shell of this test run has set for the middleware."""
    for variable in MIDDLEWARE_VARIABLES:
        patch.delenv(variable, raising=False)
    for variable, value in transport_of({VARIABLE: name}).variables.items():
        patch.setenv(variable, value)
