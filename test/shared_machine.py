"""One machine for several tests that leave it as it was: to start one takes two seconds."""

import itertools
import os
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from rclpy.context import Context

from testing.client import Client
from testing.forks import ForkedNodes
from testing.processes import Launcher, launched

_COUNTER = itertools.count()


@contextmanager
def shared_nodes(
    context: Context, folders: pytest.TempPathFactory, name: str
) -> Iterator[tuple[Client, Launcher]]:
    """Give a client and a launcher in a namespace that begins with ``name``, for several tests."""
    namespace = f"/{name}_{os.getpid()}_{next(_COUNTER)}"
    with launched(folders.mktemp(name), namespace, ForkedNodes) as launcher:
        client = Client(context, namespace)
        yield client, launcher
        client.close()
