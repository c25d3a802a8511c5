"""The surface of a workspace: closed, with the right volume, and whole in its files."""

import json
import struct

import numpy as np
import pytest
from strategies import is_inside

from tri_glide_kinematics.sizing import glb_bytes, height_ranges, stl_bytes, surface
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide, TriGlideGeometry
from tri_glide_kinematics.workspace import Cylinder, Workspace, WorkspaceLimits

UNEQUAL = TriGlideGeometry(((0.03, 0.21), (0.2, -0.08), (-0.17, -0.1)), (0.4, 0.43, 0.37))
SHORT = ((0.3, 0.35, 0.3), (0.45, 0.5, 0.42))
LONG = ((0.3, 0.3, 0.3), (0.9, 0.9, 0.9))


def workspace(geometry, travel, condition=6.0, **space):
    return Workspace(TriGlide(geometry), WorkspaceLimits(*travel, 0.005, condition, **space))


WORKSPACES = {
    "default": workspace(DEFAULT_GEOMETRY, LONG),
    "unequal": workspace(UNEQUAL, LONG, 4.0),
    "little travel": workspace(UNEQUAL, SHORT, 20.0),
    "a box in a corner": workspace(
        DEFAULT_GEOMETRY, LONG, box_lower=(0.02, 0.01, 0.1), box_upper=(0.2, 0.2, 0.3)
    ),
    "a cylinder": workspace(DEFAULT_GEOMETRY, LONG, cylinder=Cylinder(0.03, 0.0, 0.1, 0.1, 0.4)),
}


def is_closed(triangles):
    """Whether each edge is run through as often in one direction as in the other, and but once."""
    edges = np.concatenate((triangles[:, :2], triangles[:, 1:], triangles[:, [2, 0]]))
    forward, counts = np.unique(edges, axis=0, return_counts=True)
    backward = np.unique(edges[:, ::-1], axis=0)
    return bool((counts == 1).all()) and np.array_equal(forward, backward)


@pytest.fixture(scope="module")
def meshes():
    return {name: surface(place) for name, place in WORKSPACES.items()}


@pytest.mark.parametrize("name", WORKSPACES)
def test_the_surface_is_closed_and_holds_the_volume(meshes, name):
    mesh, place = meshes[name], WORKSPACES[name]
    assert is_closed(mesh.triangles)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    # Columns in the middles of a grid; their heights are those of the workspace by another test.
    middles = (np.arange(120) + 0.5) / 120.0
    parts = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    bottoms, tops = height_ranges(place, low[:2] + parts * (high - low)[:2])
    volume = np.nan_to_num(tops - bottoms).mean() * np.prod((high - low)[:2])
    assert mesh.volume == pytest.approx(volume, rel=0.005)
    # Nothing sticks out of the limits.
    rng = np.random.default_rng(6)
    for vertex in mesh.vertices[rng.integers(len(mesh.vertices), size=40)].tolist():
        around = np.array(vertex) + 3e-4 * rng.uniform(-1.0, 1.0, (40, 3))
        assert any(is_inside(place, each) for each in around.tolist())


@pytest.mark.parametrize("name", WORKSPACES)
def test_ranges_of_heights_are_those_of_the_workspace(name):
    place = WORKSPACES[name]
    rng = np.random.default_rng(7)
    points = np.column_stack((rng.uniform(-0.25, 0.25, (400, 2)), rng.uniform(-0.1, 0.7, 400)))
    low, high = height_ranges(place, points[:, :2])
    expected = [is_inside(place, point) for point in points.tolist()]
    assert ((points[:, 2] >= low) & (points[:, 2] <= high)).tolist() == expected
    assert any(expected)


def test_a_workspace_without_places_has_no_triangles():
    none = workspace(DEFAULT_GEOMETRY, LONG, box_lower=(0.1, 0.1, 2.0), box_upper=(0.2, 0.2, 3.0))
    assert not len(surface(none).triangles)
    apart = workspace(DEFAULT_GEOMETRY, LONG, box_lower=(5.0, 0.1, 0.2))
    assert not len(surface(apart).triangles)


@pytest.mark.parametrize("name", ["default", "little travel"])
def test_a_file_in_stl_is_closed_too(meshes, name):
    mesh = meshes[name]
    content = stl_bytes(mesh)
    (count,) = struct.unpack_from("<I", content, 80)
    assert not content.startswith(b"solid")
    assert (count, len(content)) == (len(mesh.triangles), 84 + 50 * count)
    records = np.frombuffer(content, np.dtype([("numbers", "<f4", 12), ("rest", "<u2")]), offset=84)
    corners = records["numbers"][:, 3:].reshape(-1, 3)
    _, numbers = np.unique(corners, axis=0, return_inverse=True)
    assert is_closed(numbers.reshape(-1, 3))
    a, b, c = corners.astype(float).reshape(-1, 3, 3).transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    assert np.einsum("ij,ij->", a, normals) / 6e9 == pytest.approx(mesh.volume, rel=1e-5)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    assert (sizes > 0.0).all()
    np.testing.assert_allclose(records["numbers"][:, :3], normals / sizes, atol=1e-5)


def test_a_file_in_gltf_holds_the_mesh(meshes):
    mesh = meshes["default"]
    content = glb_bytes(mesh)
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack_from("<I4s", content, 12)
    assert (kind, size % 4) == (b"JSON", 0)
    head = json.loads(content[20 : 20 + size])
    body_size, body_kind = struct.unpack_from("<I4s", content, 20 + size)
    body = content[28 + size :]
    assert (body_kind, body_size, len(body) % 4) == (b"BIN\0", len(body), 0)
    assert head["buffers"] == [{"byteLength": len(body)}]
    arrays = []
    for accessor, kind in zip(head["accessors"], ("<f4", "<u4")):
        view = head["bufferViews"][accessor["bufferView"]]
        part = body[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        arrays.append(np.frombuffer(part, kind).reshape(-1, 3))
    positions, triangles = arrays
    np.testing.assert_allclose(positions, mesh.vertices, atol=1e-7)
    np.testing.assert_array_equal(triangles, mesh.triangles)
    accessor = head["accessors"][0]
    assert accessor["count"] == len(positions)
    assert accessor["min"] == positions.min(axis=0).tolist()
    assert accessor["max"] == positions.max(axis=0).tolist()
    # Up is y in this format.
    x, y, z, w = head["nodes"][0]["rotation"]
    up = (2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y))
    np.testing.assert_allclose(up, (0.0, 1.0, 0.0), atol=1e-12)
