"""How well a node does its work, in a level, a line and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple


class Level(IntEnum):
    """Levels as in ``diagnostic_msgs/DiagnosticStatus`` and REP 107."""

    OK = 0  # does its work
    WARN = 1  # does its work, but somebody should look
    ERROR = 2  # does not do its work
    STALE = 3  # has no data yet


class Health(NamedTuple):
    """What a node says about itself.

    Attributes:
        level: how well it does its work.
        message: one line.
        values: numbers behind it.
    """

    level: Level
    message: str
    values: Mapping[str, object]
