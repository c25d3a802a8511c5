"""The positions of the parts of a machine, to be drawn. No viser in here."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.tri_glide import TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray, Vector3

Quaternion = tuple[float, float, float, float]
Place2 = tuple[float, float]


@dataclass(frozen=True)
class Parts:
    """The parts of a machine.

    The kinematics know the difference between tower joint and platform joint only, so where one
    of them is drawn is a choice.

    Attributes:
        towers: horizontal places of the tower joints. Shape (3, 2) [m].
        platform_joints: from the centre of the platform. Shape (3, 2) [m].
        arm_lengths: Shape (3,) [m].
        across: horizontal direction of each arm's joints. Shape (3, 2).
    """

    towers: tuple[Place2, Place2, Place2]
    platform_joints: tuple[Place2, Place2, Place2]
    arm_lengths: Vector3
    across: tuple[Place2, Place2, Place2]

    @classmethod
    def of(cls, geometry: TriGlideGeometry, platform_radius: float) -> Parts:
        """Return the parts with platform joints on a circle of this radius [m]."""
        towers, joints, across = [], [], []
        for x, y in geometry.anchors:
            size = hypot(x, y) or 1.0
            ux, uy = x / size, y / size
            joints.append((platform_radius * ux, platform_radius * uy))
            towers.append((x + platform_radius * ux, y + platform_radius * uy))
            across.append((-uy, ux))
        return cls(_three(towers), _three(joints), geometry.arm_lengths, _three(across))

    def arm_turn(self, index: int, height: float, position: Vector3) -> Quaternion:
        """Return how an arm is turned that hangs down along -z from its carriage.

        Args:
            index: of the arm.
            height: of its carriage [m].
            position: of the platform. Shape (3,) [m].
        """
        (tx, ty), (px, py) = self.towers[index], self.platform_joints[index]
        x, y, z = tx - position[0] - px, ty - position[1] - py, height - position[2]
        length = sqrt(x * x + y * y + z * z) or 1.0
        up = (x / length, y / length, z / length)
        # As level as an arm's joints can be at a right angle to it.
        ax, ay = self.across[index]
        along = ax * up[0] + ay * up[1]
        side = (ax - along * up[0], ay - along * up[1], -along * up[2])
        size = sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2) or 1.0
        return turned((side[0] / size, side[1] / size, side[2] / size), up)


def turned(x_axis: Vector3, z_axis: Vector3) -> Quaternion:
    """Return the rotation (w, x, y, z) that leads to these two axes, unit and at right angles."""
    a, b, c = x_axis
    g, h, i = z_axis
    d, e, f = h * c - i * b, i * a - g * c, g * b - h * a
    # Of the four numbers the largest first: none is divided by one near zero.
    squares = (1.0 + a + e + i, 1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i)
    largest = squares.index(max(squares))
    s = 0.5 / sqrt(squares[largest])
    if largest == 0:
        return 0.25 / s, (f - h) * s, (g - c) * s, (b - d) * s
    if largest == 1:
        return (f - h) * s, 0.25 / s, (b + d) * s, (c + g) * s
    if largest == 2:
        return (g - c) * s, (b + d) * s, 0.25 / s, (f + h) * s
    return (b - d) * s, (c + g) * s, (f + h) * s, 0.25 / s


def rod_pair(length: float, radius: float, apart: float) -> tuple[FloatArray, NDArray[np.uint32]]:
    """Return the mesh of two rods that hang down along -z from the origin, side by side along x.

    Args:
        length: Of each [m].
        radius: Of each [m].
        apart: Distance between them [m].

    Returns:
        Vertices, shape (n, 3) [m], and faces, shape (m, 3).
    """
    corners = 8
    angles = np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    ring = radius * np.column_stack((np.cos(angles), np.sin(angles)))
    vertices: list[FloatArray] = []
    faces: list[tuple[int, int, int]] = []
    for offset in (-0.5 * apart, 0.5 * apart):
        first = len(vertices) * corners
        for z in (0.0, -length):
            vertices.append(np.column_stack((ring + np.array((offset, 0.0)), np.full(corners, z))))
        for k in range(corners):
            a, b = first + k, first + (k + 1) % corners
            faces += [(a, a + corners, b), (b, a + corners, b + corners)]
    return np.concatenate(vertices), np.array(faces, dtype=np.uint32)


def skin(rings: FloatArray) -> tuple[FloatArray, NDArray[np.uint32]]:
    """Return the mesh of a body between rings of points, closed at both ends.

    Args:
        rings: Shape (levels, n, 3) [m].

    Returns:
        Vertices, shape (levels n + 2, 3) [m], and faces, shape (m, 3).
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


def _three(places: list[Place2]) -> tuple[Place2, Place2, Place2]:
    first, second, third = places
    return first, second, third
