"""What is drawn of a calibration."""

import numpy as np
import pytest
from calibration_samples import calibration
from matplotlib.figure import Figure

from tri_glide_kinematics.calibration.fit import Region
from tri_glide_kinematics.figures.calibration_pictures import (
    OUTLIER_COLOR,
    calibration_figure,
    draw_maps,
    draw_residuals,
)

REGION = Region.disc((0.0, 0.0), 0.12, 3)


@pytest.mark.parametrize("has_priors", [True, False])
def test_a_page_holds_nine_maps_and_the_residuals(has_priors):
    figure = calibration_figure(calibration(has_priors=has_priors))
    maps = [axes for axes in figure.axes if axes.get_xlabel() == "x [mm]"]
    assert len(maps) == 9
    titles = [axes.get_title() for axes in maps]
    assert all(letter in title for letter, title in zip(3 * "xyz", titles))
    unknown = [axes for axes in maps if any(text.get_text() == "not known" for text in axes.texts)]
    # Without priors nothing is known before, and x and y only in themselves.
    assert len(unknown) == (0 if has_priors else 5)
    if unknown:
        figure.set_layout_engine("none")
        figure.draw_without_rendering()


def test_a_map_shows_its_largest_value():
    axes = Figure().add_subplot()
    values = 1e-5 + 1e-4 * np.linalg.norm(REGION.places, axis=1)
    draw_maps([axes], REGION, values[:, np.newaxis], ["x"])
    assert axes.get_title() == "x:\nat most 22 µm"


def test_maps_side_by_side_have_one_scale():
    figure = Figure()
    maps = figure.subplots(1, 3).tolist()
    values = np.multiply.outer(np.linalg.norm(REGION.places, axis=1), (1e-5, 1e-3, 1e-2))
    draw_maps(maps, REGION, values, "xyz")
    levels = [axes.collections[0].get_clim() for axes in maps]
    assert levels[0] == levels[1] == levels[2]
    # Three maps and one scale of colours.
    assert len(figure.axes) == 4


@pytest.mark.parametrize("value", [0.0, 1e-5, 0.002])
def test_one_value_everywhere_can_be_drawn(value):
    axes = Figure().add_subplot()
    draw_maps([axes], REGION, np.full((len(REGION.places), 1), value), ["x"])
    axes.figure.draw_without_rendering()


def test_residuals_are_bars_and_an_outlier_is_marked():
    residuals = calibration(outlier=0.002).residuals
    axes = Figure().add_subplot()
    draw_residuals(axes, residuals)
    (bars,) = axes.containers
    assert len(bars) == len(residuals)
    heights = [one.error[0] / one.measurement.standard_deviation for one in residuals]
    assert [bar.get_height() for bar in bars] == pytest.approx(heights)
    assert bars[2].get_facecolor()[:3] != bars[3].get_facecolor()[:3]
    assert [text.get_text() for text in axes.texts] == ["touch 3 left out"]
    assert OUTLIER_COLOR == "tab:red"
    axes.figure.draw_without_rendering()
