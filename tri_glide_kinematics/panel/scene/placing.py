"""Moves parts of viser's scene that are known to have moved.

viser compares each new place with the last one by numpy, which takes three times as long as all
else that moves a part. This uses what viser does not offer to its users, as ``page`` does.
"""

from __future__ import annotations

from typing import Any

from viser import _messages as messages

from tri_glide_kinematics.panel.scene.shapes import Quaternion
from tri_glide_kinematics.vectors import Vector3


def place(handle: Any, position: Vector3) -> None:
    """Move a part to a ``position`` [m] in the frame of what it belongs to."""
    handle._impl.position[:] = position
    handle._impl.api._queue_scene_message(messages.SetPositionMessage(handle.name, position))


def turn(handle: Any, wxyz: Quaternion) -> None:
    """Turn a part to a rotation in the frame of what it belongs to."""
    handle._impl.wxyz[:] = wxyz
    handle._impl.api._queue_scene_message(messages.SetOrientationMessage(handle.name, wxyz))
