"""Duty cycles, and the parameter file of a machine."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tri_glide_kinematics.motion import plan_move, time_path
from tri_glide_kinematics.settings import (
    FK_NODE,
    IK_NODE,
    SIMULATOR_NODE,
    file_values,
    limits_of,
    machine_of,
    workspace_limits_of,
)
from tri_glide_kinematics.sizing import (
    Box,
    Wish,
    duty_load,
    parameter_text,
    pick_and_place,
    sizing_of,
)
from tri_glide_kinematics.workspace import Cylinder, Workspace

WISH = Wish(Cylinder(0.0, 0.0, 0.16, 0.1, 0.25), 1.0, 10.0, payload=0.2)
SIZING = sizing_of(WISH, 0.25, 0.4)
IN_A_BOX = sizing_of(replace(WISH, volume=Box((0.01, 0.02, 0.3), (0.06, 0.09, 0.31))), 0.25, 0.4)


@pytest.mark.parametrize("sizing", [SIZING, IN_A_BOX], ids=["cylinder", "small box"])
def test_pick_and_place_asks_for_no_more_than_is_proved(sizing):
    wish = sizing.wish
    load = duty_load(sizing)
    assert (load.peak_force <= sizing.force).all()
    assert (load.continuous_force < load.peak_force).all()
    assert (load.peak_speed <= sizing.slider_speed).all()
    assert (load.peak_power <= load.peak_force * load.peak_speed).all()
    assert (load.mean_power < load.peak_power).all()
    workspace = Workspace(sizing.machine, sizing.workspace_limits())
    motion = time_path(pick_and_place(wish.volume, wish.speed), workspace, load.limits)
    assert motion.duration == pytest.approx(load.duration)
    step = 2e-3
    heights = motion.sample(np.arange(0.0, motion.duration, step)).heights
    places = sizing.machine.forward_batch(heights)
    speeds = np.linalg.norm(np.gradient(places, step, axis=0), axis=1)
    accelerations = np.linalg.norm(np.diff(places, 2, axis=0), axis=1) / step**2
    assert speeds.max() <= wish.speed * 1.001
    # It is used, and not passed.
    assert 0.8 * wish.acceleration < accelerations.max() < 1.01 * wish.acceleration


def test_the_cycle_is_25_305_25_mm_where_there_is_room():
    path = pick_and_place(WISH.volume, 1.0)
    assert path.count == 6
    np.testing.assert_allclose(path.end, (-0.1525, 0.0, 0.103), atol=1e-12)
    motion = duty_load(SIZING)
    assert motion.duration < 3.0


def test_another_cycle_may_be_driven():
    start, end = (0.0, 0.0, 0.15), (0.05, 0.0, 0.2)
    load = duty_load(SIZING, lambda workspace, limits: plan_move(workspace, limits, start, end))
    assert 0.0 < load.duration < 1.0


@pytest.mark.parametrize("sizing", [SIZING, IN_A_BOX], ids=["cylinder", "box"])
def test_nodes_take_the_parameter_file_and_all_of_the_volume_is_inside(tmp_path, sizing):
    file = tmp_path / "machine.yaml"
    file.write_text(parameter_text(sizing))
    simulated = file_values(str(file), "/simulator_node", SIMULATOR_NODE)
    assert machine_of(file_values(str(file), "/fk_node", FK_NODE)) == sizing.machine
    values = file_values(str(file), "/ik_node", IK_NODE)
    assert machine_of(values) == machine_of(simulated) == sizing.machine
    limits = limits_of(values)
    np.testing.assert_allclose(limits.table, sizing.slider_limits().table, rtol=1e-9)
    workspace = Workspace(machine_of(values), workspace_limits_of(values))
    workspace.check_heights(simulated["initial_heights"])
    volume = sizing.wish.volume
    if isinstance(volume, Box):
        (x, y, bottom), (far_x, far_y, top) = volume.lower, volume.upper
        edge = [(x, y), (far_x, y), (far_x, far_y), (x, far_y)]
    else:
        bottom, top = volume.z_min, volume.z_max
        angles = np.linspace(0.0, 2.0 * np.pi, 25)
        edge = (volume.radius * np.column_stack((np.cos(angles), np.sin(angles)))).tolist()
    for place, following in pairwise(edge):
        for z in (bottom, top):
            workspace.check_segment((*place, z), (*following, z))
