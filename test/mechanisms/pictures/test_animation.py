"""Animations: as many different frames as asked for, along one branch."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageChops

from tri_glide_kinematics.mechanisms import load_mechanism
from tri_glide_kinematics.mechanisms.four_bar import Branch, FourBar
from tri_glide_kinematics.mechanisms.pictures.drawing import save_movie
from tri_glide_kinematics.mechanisms.pictures.f_mechanism import (
    detailed_overview,
    f_mechanism_movie,
)
from tri_glide_kinematics.mechanisms.pictures.four_bar import four_bar_movie

CONFIG = Path(__file__).parents[3] / "config"
POINT = (0.03, 0.02)
TURNING = FourBar(0.02, 0.07, 0.09, 0.06)
LIMITED = FourBar(0.08, 0.03, 0.09, 0.10)
ONE_CHANGE_POINT = FourBar(0.03, 0.08, 0.05, 0.10)


def steps(points):
    """Longest way of a point from each frame to the next, and back to the first."""
    return np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=-1).max(axis=-1)


@pytest.fixture(scope="module")
def branches():
    example = load_mechanism(CONFIG / "f_mechanism_example_2.yaml").mechanism
    return detailed_overview(example).branches


@pytest.mark.parametrize("frames", [2, 7])
def test_a_gif_has_the_frames_that_were_asked_for(branches, tmp_path, frames):
    file = tmp_path / "branch.gif"
    counted = []
    save_movie(f_mechanism_movie(branches[1], "title", frames), file, lambda: counted.append(1))
    assert len(counted) == frames
    with Image.open(file) as image:
        assert image.n_frames == frames
        assert image.info["loop"] == 0
        pictures = []
        for frame in range(frames):
            image.seek(frame)
            pictures.append(image.convert("RGB"))
    for one, other in itertools.pairwise(pictures):
        assert ImageChops.difference(one, other).getbbox()
    assert pictures[0].getpixel((1, 1)) == (255, 255, 255)


@pytest.mark.parametrize("frames", [5, 6])
def test_no_frame_is_lost_where_a_crank_turns_back(tmp_path, frames):
    file = tmp_path / "limited.gif"
    save_movie(four_bar_movie(LIMITED, POINT, Branch.OPEN, frames), file)
    with Image.open(file) as image:
        assert image.n_frames == frames


@pytest.mark.parametrize("number", [0, 1])
def test_the_f_mechanism_moves_along_its_branch_and_back_to_its_start(branches, number):
    movie = f_mechanism_movie(branches[number], "branch", 90)
    assert movie.points.shape == (90, 9, 2) and len(set(movie.captions)) == 90
    for start, end, length in zip((3, 4, 5), (6, 7, 8), (0.035, 0.034, 0.054)):
        rods = np.linalg.norm(movie.points[:, end] - movie.points[:, start], axis=-1)
        np.testing.assert_allclose(rods, length, atol=1e-12)
    # No jump, neither within nor where the animation starts again.
    assert steps(movie.points).max() < 0.01
    singular = {event.pose.angle for event in branches[number].turning_points}
    assert len(singular) == (4 if number == 0 else 0)


@pytest.mark.parametrize("branch", list(Branch))
@pytest.mark.parametrize("linkage", [TURNING, LIMITED, ONE_CHANGE_POINT])
def test_the_four_bar_moves_on_one_branch_without_a_jump(linkage, branch):
    movie = four_bar_movie(linkage, POINT, branch, 120)
    assert movie.points.shape == (120, 5, 2) and not np.isnan(movie.points).any()
    for start, end, length in (
        (0, 1, linkage.crank),
        (1, 2, linkage.coupler),
        (3, 2, linkage.rocker),
    ):
        links = np.linalg.norm(movie.points[:, end] - movie.points[:, start], axis=-1)
        np.testing.assert_allclose(links, length, rtol=1e-9)
    assert steps(movie.points).max() < 0.12 * linkage.lengths.longest


def test_a_limited_crank_comes_near_both_of_its_limits():
    movie = four_bar_movie(LIMITED, POINT, Branch.OPEN, 200, crank_angle=-1.0)
    crank = np.arctan2(movie.points[:, 1, 1], movie.points[:, 1, 0])
    (low, high) = min(LIMITED.crank_ranges)
    assert low <= crank.min() < low + 1e-3 and high - 1e-3 < crank.max() <= high
