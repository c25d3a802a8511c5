"""The picture of a machine shows what its maps say."""

import numpy as np
import pytest

from tri_glide_kinematics.figures import machine, machine_figure
from tri_glide_kinematics.sizing import maps
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

MACHINE = TriGlide(DEFAULT_GEOMETRY)
LIMITS = WorkspaceLimits((0.3, 0.3, 0.3), (0.9, 0.9, 0.9), 0.005, 6.0)
VELOCITIES = (1.0, 1.2, 1.5)


def test_maps_are_what_they_are_defined_as():
    rng = np.random.default_rng(8)
    places = np.concatenate((rng.uniform(-0.12, 0.12, (20, 2)), [(0.3, 0.3)]))
    found = maps(Workspace(MACHINE, LIMITS), places, VELOCITIES, 2e-6)
    # Directions everywhere, and corners of the box in which forces of the sliders may be.
    around = rng.normal(size=(20_000, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    for k, place in enumerate(places[:-1]):
        jacobian = np.array(MACHINE.jacobian((*place, 0.3)))
        speeds = 1.0 / np.abs(around @ jacobian.T / VELOCITIES).max(axis=1)
        forces = 1.0 / np.abs(around @ np.linalg.inv(jacobian)).max(axis=1)
        for number, all_around in ((found.speeds[k], speeds), (found.forces[k], forces)):
            assert number <= all_around.min() <= 1.01 * number
        assert found.conditions[k] == pytest.approx(MACHINE.condition_number((*place, 0.3)))
        yielding = np.linalg.inv(jacobian) @ np.linalg.inv(jacobian).T
        softest = 1.0 / np.linalg.eigvalsh(yielding)[-1]
        assert found.stiffnesses[k] == pytest.approx(softest)
        assert 2e-6 < found.resolutions[k] < 1e-5
    for values in (found.heights[0], *found[1:]):
        assert np.isnan(values[-1])
        assert np.isfinite(values[:-1]).all()


def test_a_machine_has_six_maps_and_two_cuts(monkeypatch):
    monkeypatch.setattr(machine, "PLACES", 41)
    workspace = Workspace(MACHINE, LIMITS)
    figure = machine_figure(workspace, VELOCITIES, 1e-5, "a.yaml")
    panels = [axes for axes in figure.axes if axes.get_title()]
    titles = [axes.get_title() for axes in panels]
    assert len(titles) == 8
    assert titles[0] == "condition number"
    assert titles[5] == "height of the workspace [mm]"
    shown = panels[0].collections[0].get_array()
    assert 2.4 < np.nanmin(shown) < 2.5
    assert 5.5 < np.nanmax(shown) <= 6.0
    lowest = [line.get_ydata() for line in panels[6].lines[:2]]
    assert np.nanmin(lowest[0]) == pytest.approx(300.0 - 346.410, abs=0.1)

    def deviations(places):
        return 1e-5 * np.ones((len(places), 3))

    figure = machine_figure(workspace, VELOCITIES, 1e-5, "a.yaml", deviations)
    (uncertainty,) = (axes for axes in figure.axes if "uncertainty" in axes.get_title())
    assert np.nanmax(uncertainty.collections[0].get_array()) == pytest.approx(17.32, abs=0.01)
