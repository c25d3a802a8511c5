"""Shows path, target and workspace in RViz and Foxglove, while somebody looks."""

from __future__ import annotations

import time

import numpy as np
from rclpy.node import Node
from visualization_msgs.msg import Marker, MarkerArray

from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine import MotionEngine
from tri_glide_kinematics.motion.path import DrivenPath, PathPolylines, polylines_of
from tri_glide_kinematics.ros.cdr import MarkerShape, marker_array
from tri_glide_kinematics.ros.loop import steady_timer
from tri_glide_kinematics.ros.outputs.machine_state import LATCHED
from tri_glide_kinematics.vectors import Vector3
from tri_glide_kinematics.workspace import Workspace, outline

# How often one looks whether there is something to show [s].
LOOK_PERIOD = 0.2

# While it is made, there is a turn in each of these periods, of this length at most [s].
TURN_PERIOD = 0.02
TURN = 0.0003

NOTHING = np.empty((0, 3))
NO_PATH = PathPolylines(NOTHING, NOTHING)

PROGRAMMED = MarkerShape(
    "path as programmed", Marker.LINE_STRIP, (0.0004, 0.0, 0.0), (0.6, 0.6, 0.6, 1.0)
)
DRIVEN = MarkerShape("path as driven", Marker.LINE_STRIP, (0.0008, 0.0, 0.0), (0.1, 0.6, 1.0, 1.0))
TARGET = MarkerShape("target", Marker.SPHERE, (0.006, 0.006, 0.006), (1.0, 0.2, 0.1, 1.0))
OUTLINE = MarkerShape("workspace", Marker.LINE_LIST, (0.0005, 0.0, 0.0), (0.3, 0.8, 0.4, 0.5))
ALL = (PROGRAMMED, DRIVEN, TARGET, OUTLINE)


class Markers:
    """Publishes ``markers``, latched: the path, the target, and the outline of the workspace.

    They are made when somebody listens and something has changed, in short turns beside the control
    cycle.
    """

    def __init__(
        self,
        node: Node,
        workspace: Workspace,
        base_frame: str,
        engine: MotionEngine,
    ) -> None:
        """Publish the outline of the ``workspace``, and path and target of the ``engine``."""
        self._base_frame = base_frame
        self._engine = engine
        self._publisher = node.create_publisher(MarkerArray, "markers", LATCHED)
        self._polylines = NO_PATH
        self._outline = NOTHING
        self._shown: tuple[DrivenPath | None, Vector3 | None] | None = None
        self._names: set[str] = set()
        # The drawings in work: path and target, and when these are shown the outline.
        self._showing: Interruptible[None] | None = None
        self._outlining: Interruptible[None] | None = self._with_outline(workspace)
        steady_timer(node, LOOK_PERIOD, self._look)
        self._turns = steady_timer(node, TURN_PERIOD, self._turn)
        self._turns.cancel()

    def _look(self) -> None:
        """Begin to make what is to be shown, if it is not shown yet and somebody listens."""
        if self._showing is not None or not self._publisher.get_subscription_count():
            return
        wanted = self._engine.driven_path, self._engine.target
        if wanted != self._shown:
            before = self._shown[0] if self._shown else None
            self._shown = wanted
            self._showing = self._with_path(wanted[0], is_new=wanted[0] is not before)
        if self._showing is not None or self._outlining is not None:
            self._turns.reset()

    def _turn(self) -> None:
        """Go on for a short time."""
        end = time.monotonic() + TURN
        while time.monotonic() < end:
            making = self._showing or self._outlining
            if making is None:
                self._turns.cancel()
                return
            try:
                next(making)
            except StopIteration:
                if making is self._showing:
                    self._showing = None
                else:
                    self._outlining = None

    def _with_path(self, path: DrivenPath | None, *, is_new: bool) -> Interruptible[None]:
        """Publish all with the present target, and with another path if there is one."""
        if is_new:
            self._polylines = NO_PATH if path is None else (yield from polylines_of(path))
        self._publish()

    def _with_outline(self, workspace: Workspace) -> Interruptible[None]:
        """Publish all, and the outline of the ``workspace`` from now on."""
        self._outline = yield from outline(workspace)
        self._publish()

    def _publish(self) -> None:
        """Publish all that is there, and delete what was there the last time."""
        target = self._shown[1] if self._shown else None
        lines = (
            (PROGRAMMED, self._polylines.programmed),
            (DRIVEN, self._polylines.driven),
            (OUTLINE, self._outline),
        )
        shapes = [shape._replace(points=points) for shape, points in lines if len(points)]
        if target is not None:
            shapes.append(TARGET._replace(position=target))
        names = {shape.name for shape in shapes}
        gone = self._names - names
        shapes += [shape._replace(is_deleted=True) for shape in ALL if shape.name in gone]
        self._names = names
        if shapes:
            self._publisher.publish(marker_array(shapes, self._base_frame))
