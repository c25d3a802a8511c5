"""The machine in viser's scene: everything is put there once, and then only moved."""

from __future__ import annotations

from math import cos, sin
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from tri_glide_kinematics.description import Parts
from tri_glide_kinematics.panel.link import MachineFacts
from tri_glide_kinematics.panel.machine import Pose
from tri_glide_kinematics.panel.viser_parts import Quaternion, place, turn
from tri_glide_kinematics.vectors import FloatArray, Vector3


def arm_turn(parts: Parts, arm: int, height: float, position: Vector3) -> Quaternion:
    """Return how an arm is turned (w, x, y, z) that hangs along -z from its carriage.

    Args:
        parts: of the machine.
        arm: index, 0 to 2.
        height: true one of the carriage [m].
        position: of the platform. Shape (3,) [m].
    """
    swing, tilt = (0.5 * angle for angle in parts.swing_and_tilt(arm, height, position))
    azimuth = 0.5 * parts.azimuth(arm)
    w, x, y, z = (
        cos(swing) * cos(tilt),
        sin(swing) * cos(tilt),
        cos(swing) * sin(tilt),
        sin(swing) * sin(tilt),
    )
    c, s = cos(azimuth), sin(azimuth)
    return c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w


def skin(rings: FloatArray) -> tuple[FloatArray, NDArray[np.uint32]]:
    """Return the mesh of a body between rings of points, shape (levels, n, 3), closed at both ends.

    Returns vertices, shape (levels n + 2, 3) [m], and faces, shape (m, 3).
    """
    levels, count, _ = rings.shape
    ends = rings[[0, -1]].mean(axis=1)
    vertices = np.concatenate((rings.reshape(-1, 3), ends))
    here = np.arange(count)
    after = np.roll(here, -1)
    faces = []
    for level in range(levels - 1):
        low, high = level * count, (level + 1) * count
        faces.append(np.column_stack((low + here, low + after, high + here)))
        faces.append(np.column_stack((low + after, high + after, high + here)))
    bottom, top = len(vertices) - 2, len(vertices) - 1
    last = (levels - 1) * count
    faces.append(np.column_stack((np.full(count, bottom), after, here)))
    faces.append(np.column_stack((np.full(count, top), last + here, last + after)))
    return vertices, np.concatenate(faces).astype(np.uint32)


# A shorter move of a part is not sent: it would not be seen [m].
SMALLEST_MOVE = 2e-5

RGB = tuple[int, int, int]
# Colours of what is drawn: red, green and blue from 0 to 255.
# Seen on white, and on the grey of a dark page.
TOWER: RGB = (84, 90, 98)
TRAVEL_END: RGB = (170, 40, 30)
MEASURED: RGB = (40, 46, 56)
CARRIAGE: RGB = (200, 120, 20)
COMMANDED: RGB = (30, 120, 255)
SHELL: RGB = (70, 170, 110)
PROGRAMMED: RGB = (150, 150, 150)
DRIVEN: RGB = (26, 153, 255)
TRACE: RGB = (230, 90, 20)
TARGET: RGB = (220, 40, 30)
COMMANDED_OPACITY = 0.3  # the measured machine is seen through the commanded one
# A shadow would show nothing of a machine.
PLAIN: dict[str, Any] = {"cast_shadow": False, "receive_shadow": False}
AMBIENT_LIGHT = 2.0  # intensity, as viser counts it

_ROOTS = (
    *("tower_0", "tower_1", "tower_2", "floor", "measured", "commanded", "target", "workspace"),
)

NO_LINES: NDArray[np.float32] = np.zeros((0, 2, 3), dtype=np.float32)


class DrawnMachine:
    """One machine that moves, solid or as a ghost."""

    def __init__(self, scene: viser.SceneApi, name: str, parts: Parts, *, is_ghost: bool) -> None:
        """Put it into the ``scene``, not to be seen before it is moved.

        A ghost is what is commanded, and lets other things be seen through it.
        """
        self._parts, size = parts, parts.size
        self._shown: Pose | None = None
        opacity = COMMANDED_OPACITY if is_ghost else None
        color = COMMANDED if is_ghost else MEASURED
        self._root = scene.add_frame(name, show_axes=False, visible=False)
        self._carriages = [
            scene.add_box(
                f"{name}/carriage_{index}",
                color=COMMANDED if is_ghost else CARRIAGE,
                dimensions=(2.4 * size, 2.4 * size, 2.0 * size),
                opacity=opacity,
                **PLAIN,
                position=(x, y, 0.0),
            )
            for index, (x, y) in enumerate(parts.towers)
        ]
        self._arms = []
        for index, length in enumerate(parts.arm_lengths):
            arm = f"{name}/carriage_{index}/arm"
            self._arms.append(scene.add_frame(arm, show_axes=False))
            for side in (-0.5, 0.5):
                scene.add_cylinder(
                    f"{arm}/{'left' if side < 0.0 else 'right'}",
                    radius=parts.rod_radius,
                    height=length,
                    color=color,
                    radial_segments=8,
                    opacity=opacity,
                    **PLAIN,
                    position=(side * parts.rod_distance, 0.0, -0.5 * length),
                )
        self._platform = scene.add_cylinder(
            f"{name}/platform",
            radius=parts.platform_radius,
            height=size,
            color=color,
            opacity=opacity,
            **PLAIN,
        )

    def differs(self, pose: Pose | None) -> bool:
        """Tell whether this ``pose`` looks different from what is shown."""
        if self._shown is None or pose is None:
            return self._shown is not pose
        return not _is_near(self._shown, pose)

    def show(self, pose: Pose | None) -> None:
        """Show it in this ``pose``; None for nowhere."""
        if not self.differs(pose):
            return
        self._shown = pose
        self._root.visible = pose is not None
        if pose is None:
            return
        for index, height in enumerate(pose.heights):
            x, y = self._parts.towers[index]
            place(self._carriages[index], (x, y, height))
            turn(self._arms[index], arm_turn(self._parts, index, height, pose.position))
        place(self._platform, pose.position)


class Scene:
    """All that is drawn of one machine: as it is measured, and as it is commanded."""

    def __init__(self, scene: viser.SceneApi, facts: MachineFacts) -> None:
        """Put a machine into an empty ``scene``."""
        self._scene = scene
        geometry = facts.machine.geometry
        parts = Parts.of(geometry, facts.values["platform_radius"])
        lower, upper = facts.travel
        size = parts.size
        scene.set_up_direction("+z")
        self._draw_towers(parts, lower, upper, size)
        self.measured = DrawnMachine(scene, "/measured", parts, is_ghost=False)
        self.commanded = DrawnMachine(scene, "/commanded", parts, is_ghost=True)
        self._lines = {
            name: scene.add_line_segments(
                f"/{name}", NO_LINES, color, thickness=width, thickness_units="screen"
            )
            for name, color, width in (
                ("programmed", PROGRAMMED, 1.0),
                ("driven", DRIVEN, 1.5),
                ("trace", TRACE, 4.0),
            )
        }
        self._target = scene.add_icosphere(
            "/target", 0.5 * size, TARGET, visible=False, cast_shadow=False
        )
        self._target_place: Vector3 | None = None

    def remove(self) -> None:
        """Remove all of it, with what stands below it."""
        for name in (*_ROOTS, *self._lines):
            if self._scene.get_handle_by_name(f"/{name}") is not None:
                self._scene.remove_by_name(f"/{name}")

    def show_target(self, position: Vector3 | None) -> None:
        """Show where the machine goes, if it goes anywhere [m]."""
        if position == self._target_place:
            return
        self._target_place = position
        self._target.visible = position is not None
        if position is not None:
            self._target.position = position

    def show_lines(self, name: str, points: FloatArray) -> None:
        """Show a polyline as ``programmed``, ``driven`` or ``trace``. Shape (n, 3) [m]."""
        pairs = NO_LINES
        if len(points) > 1:
            pairs = np.stack((points[:-1], points[1:]), axis=1).astype(np.float32)
        self._lines[name].points = pairs

    def show_workspace(self, rings: FloatArray) -> None:
        """Show the edge of the workspace as a translucent body. Shape (levels, n, 3) [m]."""
        if len(rings):
            vertices, faces = skin(rings)
            self._scene.add_mesh_simple(
                "/workspace",
                vertices.astype(np.float32),
                faces,
                color=SHELL,
                opacity=0.12,
                side="double",
                **PLAIN,
            )

    def _draw_towers(self, parts: Parts, lower: Vector3, upper: Vector3, size: float) -> None:
        for index in range(3):
            low, high = lower[index] - 2.0 * size, upper[index] + 2.0 * size
            self._scene.add_box(
                f"/tower_{index}",
                color=TOWER,
                dimensions=(size, size, high - low),
                position=(*parts.column(index), 0.5 * (low + high)),
                cast_shadow=False,
            )
            for end, height in (("lower", lower[index]), ("upper", upper[index])):
                self._scene.add_box(
                    f"/tower_{index}/{end}",
                    color=TRAVEL_END,
                    dimensions=(1.6 * size, 1.6 * size, 0.25 * size),
                    position=(0.0, 0.0, height - 0.5 * (low + high)),
                    cast_shadow=False,
                )
        floor = min(min(lower) - max(parts.arm_lengths), 0.0)
        reach = 2.5 * max(float(np.hypot(x, y)) for x, y in parts.towers)
        self._scene.add_grid(
            "/floor",
            width=reach,
            height=reach,
            plane="xy",
            cell_size=0.05,
            section_size=0.25,
            position=(0.0, 0.0, max(floor, 0.0)),
        )


def light_plainly(scene: viser.SceneApi) -> None:
    """Light a scene without reflections and shadows.

    They show nothing of a machine, and a computer without a graphics card draws them for seconds.
    """
    scene.configure_environment_map(None)
    scene.configure_default_lights(cast_shadow=False)
    scene.add_light_ambient("/light", intensity=AMBIENT_LIGHT)


def view_of(facts: MachineFacts) -> tuple[Vector3, Vector3]:
    """Return where a camera stands, and where it looks, to see all of a machine [m]."""
    geometry = facts.machine.geometry
    lower, upper = facts.travel
    middle = 0.5 * (min(lower) - 0.8 * max(geometry.arm_lengths) + max(upper))
    size = max(upper) - min(lower) + max(geometry.arm_lengths)
    return (0.15 * size, -0.85 * size, middle + 0.3 * size), (0.0, 0.0, middle)


def _is_near(first: Pose, second: Pose) -> bool:
    pairs = zip((*first.heights, *first.position), (*second.heights, *second.position))
    return all(abs(one - other) < SMALLEST_MOVE for one, other in pairs)
