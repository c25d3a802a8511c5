"""The tables of the nodes: defaults that are valid, and a parameter file that fits them."""

from pathlib import Path

import pytest
import yaml

from tri_glide_kinematics.settings import NODES
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

CONFIG = Path(__file__).parents[2] / "config" / "tri_glide.yaml"
TABLES = {name: {entry.name: entry for entry in table} for name, table in NODES.items()}


@pytest.mark.parametrize("name", NODES)
def test_defaults_are_valid_and_names_unique(name):
    assert len(TABLES[name]) == len(NODES[name])
    for entry in NODES[name]:
        assert entry.checked(entry.default) == entry.default
        assert entry.meaning


def test_default_anchors_are_those_of_the_symmetric_machine():
    anchors = TABLES["ik_node"]["anchors"].default
    expected = [number for anchor in DEFAULT_GEOMETRY.anchors for number in anchor]
    assert anchors == pytest.approx(expected, abs=1e-9)


def test_parameter_file_holds_the_defaults_and_nothing_unknown():
    content = yaml.safe_load(CONFIG.read_text())
    assert list(content) == ["/**"]
    for key, value in content["/**"]["ros__parameters"].items():
        value = tuple(value) if isinstance(value, list) else value
        entries = [table[key] for table in TABLES.values() if key in table]
        assert entries, key
        for entry in entries:
            assert entry.checked(value) == entry.default, key
