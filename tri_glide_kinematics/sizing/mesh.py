"""The surface of a workspace as triangles, and its files in STL and glTF.

Above each place of a level the platform may be between two heights, which follow in closed form.
The places themselves are cut out of a grid; the points where its lines leave the workspace are
found by halving. A top and a bottom of triangles, and the walls between them, are closed by
construction.
"""

from __future__ import annotations

import json
import struct
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tri_glide_kinematics.sizing.extents import ends_over, height_ranges, level_corners
from tri_glide_kinematics.sizing.fields import Cells
from tri_glide_kinematics.vectors import BoolArray, FloatArray
from tri_glide_kinematics.workspace import Workspace

IndexArray = NDArray[np.int64]

# Cells along the longer side of a grid.
CELLS = 120

# A workspace that is thinner somewhere has no place there [m].
THINNEST = 1e-5

# Halvings, until the edge is known to less than a rounding error of the files.
HALVINGS = 30

# A point of the edge keeps this part of a cell from the corners, so that no two are the same.
APART = 1e-3

# Files in STL have no unit; programs take them for millimetres.
MILLIMETRES = 1000.0


class Mesh(NamedTuple):
    """A closed surface; seen from outside, the corners of each triangle run counter-clockwise.

    Attributes:
        vertices: Shape (n, 3) [m].
        triangles: indices of their corners. Shape (m, 3).
    """

    vertices: FloatArray
    triangles: IndexArray

    @property
    def volume(self) -> float:
        """Volume inside [m^3]."""
        a, b, c = self.vertices[self.triangles].transpose(1, 0, 2)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def surface(workspace: Workspace, cells: int = CELLS) -> Mesh:
    """Return the surface of all places where the platform may be.

    Args:
        workspace: of the machine.
        cells: along the longer side of the grid.

    Returns:
        A mesh without triangles if there is no place inside.
    """
    lower, upper = level_corners(workspace)
    none = Mesh(np.empty((0, 3)), np.empty((0, 3), dtype=np.int64))
    if not (upper > lower).all():
        return none
    step = float((upper - lower).max()) / cells
    # A rim that is outside all around, and lines that are not on the sides of a box.
    counts = np.ceil((upper - lower) / step + 0.5).astype(int) + 2
    first = 0.5 * (lower + upper - step * (counts - 1))
    x, y = (first[k] + step * np.arange(counts[k]) for k in range(2))
    corners = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    inside = _are_inside(workspace, corners.reshape(-1, 2)).reshape(counts)
    if not inside.any():
        return none
    places, polygons = _cut_out(workspace, corners, inside)
    used, numbers = np.unique(np.concatenate(polygons), return_inverse=True)
    polygons = np.split(numbers, np.cumsum([len(polygon) for polygon in polygons])[:-1])
    places = places[used]
    low, high = ends_over(workspace, Cells.of(workspace.machine.geometry, places))
    # Places of the edge may be outside by a rounding error.
    high = np.maximum(high, low + THINNEST)
    count = len(places)
    vertices = np.concatenate((np.column_stack((places, low)), np.column_stack((places, high))))
    fans = [
        (polygon[0], polygon[k], polygon[k + 1])
        for polygon in polygons
        for k in range(1, len(polygon) - 1)
    ]
    top = np.array(fans)
    walls = _rim(top)
    a, b = walls.T
    triangles = np.concatenate(
        (
            top + count,
            top[:, ::-1],
            np.stack((a, b, b + count), axis=1),
            np.stack((a, b + count, a + count), axis=1),
        )
    )
    return Mesh(vertices, triangles)


def _are_inside(workspace: Workspace, places: FloatArray) -> BoolArray:
    low, high = height_ranges(workspace, places)
    return np.asarray(high - low > THINNEST)


def _cut_out(
    workspace: Workspace, corners: FloatArray, inside: BoolArray
) -> tuple[FloatArray, list[IndexArray]]:
    """Return the places of a cut grid and the polygons of its cells, counter-clockwise.

    Each line of the grid that leaves the workspace has one more place, where it does.
    """
    numbers = np.arange(inside.size).reshape(inside.shape)
    corners, is_in = corners.reshape(-1, 2), inside.ravel()
    around = numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:]
    cells = np.stack(around, axis=-1).reshape(-1, 4)
    cells = cells[is_in[cells].any(axis=1)]
    sides = np.stack((cells, np.roll(cells, -1, axis=1)), axis=-1).reshape(-1, 2)
    leaving = sides[is_in[sides[:, 0]] & ~is_in[sides[:, 1]]]
    entering = sides[~is_in[sides[:, 0]] & is_in[sides[:, 1]]]
    lines = np.unique(np.concatenate((leaving, entering[:, ::-1])), axis=0)
    within, outside = corners[lines[:, 0]], corners[lines[:, 1]]
    near, far = np.zeros((len(lines), 1)), np.ones((len(lines), 1))
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        tried = _are_inside(workspace, within + middle * (outside - within))[:, np.newaxis]
        near, far = np.where(tried, middle, near), np.where(tried, far, middle)
    edge = within + np.clip(near, APART, 1.0 - APART) * (outside - within)
    edge_of = {(one, other): inside.size + k for k, (one, other) in enumerate(lines.tolist())}
    polygons = []
    for cell in cells.tolist():
        polygon = []
        for one, other in zip(cell, (*cell[1:], cell[0])):
            if is_in[one]:
                polygon.append(one)
            if is_in[one] != is_in[other]:
                polygon.append(edge_of[(one, other) if is_in[one] else (other, one)])
        polygons.append(np.array(polygon))
    return np.concatenate((corners, edge)), polygons


def _rim(triangles: IndexArray) -> IndexArray:
    """Return the edges of ``triangles`` that no other one shares, as they run. Shape (n, 2)."""
    edges = np.concatenate((triangles[:, :2], triangles[:, 1:], triangles[:, [2, 0]]))
    size = int(edges.max()) + 1
    forward = edges[:, 0] * size + edges[:, 1]
    backward = edges[:, 1] * size + edges[:, 0]
    return np.asarray(edges[~np.isin(forward, backward)])


def stl_bytes(mesh: Mesh) -> bytes:
    """Return a mesh as a binary file in STL, in millimetres."""
    corners = (MILLIMETRES * mesh.vertices[mesh.triangles]).astype("<f4")
    a, b, c = corners.astype(np.float64).transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    records = np.zeros(len(corners), dtype=record)
    records["normal"] = normals / np.maximum(sizes, 1e-30)
    records["corners"] = corners
    head = b"workspace of a tri-glide, in mm".ljust(80)
    return head + struct.pack("<I", len(records)) + records.tobytes()


def glb_bytes(mesh: Mesh) -> bytes:
    """Return a mesh as a binary file in glTF 2.0, in metres.

    The y axis of glTF points up; a node turns the mesh, whose z axis does.
    """
    positions = mesh.vertices.astype("<f4")
    indices = mesh.triangles.astype("<u4")
    body = positions.tobytes() + indices.tobytes()
    half = 0.5**0.5
    head = {
        "asset": {"version": "2.0", "generator": "tri_glide_kinematics"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "workspace", "mesh": 0, "rotation": [-half, 0.0, 0.0, half]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.3, 0.55, 0.85, 0.6],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.8,
                },
                "alphaMode": "BLEND",
                "doubleSided": True,
            }
        ],
        "buffers": [{"byteLength": len(body)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": positions.nbytes, "target": 34962},
            {
                "buffer": 0,
                "byteOffset": positions.nbytes,
                "byteLength": indices.nbytes,
                "target": 34963,
            },
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(positions),
                "type": "VEC3",
                "min": positions.min(axis=0).tolist(),
                "max": positions.max(axis=0).tolist(),
            },
            {"bufferView": 1, "componentType": 5125, "count": indices.size, "type": "SCALAR"},
        ],
    }
    text = json.dumps(head).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
