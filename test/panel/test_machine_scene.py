"""Where the drawn parts are."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tri_glide_kinematics.description import Parts
from tri_glide_kinematics.panel.machine_scene import arm_turn, skin
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide, TriGlideGeometry
from tri_glide_kinematics.vectors import FloatArray

UNEQUAL = TriGlideGeometry([[0.0, 0.21], [-0.17, -0.1], [0.19, -0.09]], [0.4, 0.42, 0.38])


@pytest.mark.parametrize("geometry", [DEFAULT_GEOMETRY, UNEQUAL])
def test_each_arm_ends_at_its_platform_joint(geometry: TriGlideGeometry) -> None:
    machine, parts = TriGlide(geometry), Parts.of(geometry, 0.05)
    source = np.random.default_rng(13)
    for _ in range(200):
        position = (*source.uniform(-0.05, 0.05, 2), source.uniform(0.2, 0.3))
        for index, height in enumerate(machine.inverse(position)):
            w, *xyz = arm_turn(parts, index, height, position)
            rotation = Rotation.from_quat((*xyz, w)).as_matrix()
            hangs = rotation @ (0.0, 0.0, -parts.arm_lengths[index])
            end = np.array((*parts.towers[index], height)) + hangs
            joint = np.add(position, (*parts.platform_joints[index], 0.0))
            assert end == pytest.approx(joint, abs=1e-12)
            # Its two rods lie side by side along the edge of the platform.
            assert abs(rotation[2, 0]) < 0.5


def test_towers_of_the_symmetric_machine_stand_on_their_circle() -> None:
    parts = Parts.of(DEFAULT_GEOMETRY, 0.05)
    assert [np.hypot(*tower) for tower in parts.towers] == pytest.approx([0.25] * 3)


def volume(vertices: FloatArray, faces: FloatArray) -> float:
    """Volume within faces that look outwards."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def test_a_skin_is_closed_and_looks_outwards() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    ring = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(60)))
    vertices, faces = skin(np.array([np.add(ring, (0.0, 0.0, z)) for z in (0.0, 1.0, 2.0)]))
    assert volume(vertices, faces) == pytest.approx(2.0 * np.pi, rel=0.01)
    edges = {(a, b) for face in faces.tolist() for a, b in zip(face, face[1:] + face[:1])}
    assert edges == {(b, a) for a, b in edges}
