"""Results of goals that ended some time ago, for those who ask late."""

from __future__ import annotations

import time
from typing import Any

from rclpy.serialization import deserialize_message, serialize_message

# How long [s], and how many.
KEPT = 900.0
MOST = 2000


class OldResults:
    """The newest results, by the identifiers of their goals.

    They are kept as bytes. As messages, 2000 of them are so many objects that the collector of
    garbage, which looks at them all now and then, takes several cycles for it.
    """

    def __init__(self, kind: Any) -> None:
        """Keep none yet.

        Args:
            kind: of message.
        """
        self._kind = kind
        self._kept: dict[bytes, bytes] = {}
        # When each was added, by time.monotonic() [s].
        self._added: dict[bytes, float] = {}

    def add(self, key: bytes, result: Any) -> None:
        """Keep the ``result`` of the goal with the identifier ``key``."""
        self._kept[key] = serialize_message(result)
        self._added[key] = time.monotonic()

    def get(self, key: bytes) -> Any:
        """Return the result of a goal; None if it is not kept."""
        data = self._kept.get(key)
        return None if data is None else deserialize_message(data, self._kind)

    def __contains__(self, key: bytes) -> bool:
        """Tell whether the result of a goal is kept."""
        return key in self._kept

    def forget(self) -> None:
        """Forget those that are too old or too many."""
        oldest = time.monotonic() - KEPT
        while self._added:
            key, added = next(iter(self._added.items()))
            if added >= oldest and len(self._added) <= MOST:
                return
            del self._added[key], self._kept[key]
