"""All pictures that belong to a mechanism."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure
from tqdm import tqdm

from tri_glide_kinematics.equal_numbers import first_largest
from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism, FMechanismOverview
from tri_glide_kinematics.mechanisms.files import MechanismFile, load_mechanism
from tri_glide_kinematics.mechanisms.four_bar import Branch, FourBar
from tri_glide_kinematics.mechanisms.pictures import f_mechanism, four_bar
from tri_glide_kinematics.mechanisms.pictures.drawing import Movie, degrees_text, save_movie
from tri_glide_kinematics.mechanisms.pictures.skeleton import default_branch

RESOLUTION = 110.0  # dots per inch
SHOWN_AFTER = 1.0  # a progress bar appears after so many seconds


class DrawingError(KinematicsError):
    """A picture was asked for that a mechanism does not have."""


@dataclass(frozen=True)
class Choice:
    """The pictures to draw.

    Attributes:
        branch: counted from 1; None leaves the choice to the mechanism.
        crank_angle: at which single positions are drawn [rad]; None as for the branch.
        frames: number of frames of the animation; 0 for none.
    """

    branch: int | None
    crank_angle: float | None
    frames: int


@dataclass(frozen=True)
class Pictures:
    """All that can be drawn of a mechanism.

    Attributes:
        summary: lines of text on its branches.
        figures: what each picture shows, as a part of its file's name, with the way to draw it.
        movie_name: the same for the animation.
        movie: the way to make it.
    """

    summary: tuple[str, ...]
    figures: dict[str, Callable[[], Figure]]
    movie_name: str
    movie: Callable[[], Movie]


def save_pictures(file: Path, folder: Path, choice: Choice) -> list[str]:
    """Draw all pictures of a mechanism, with a progress bar if it takes long.

    A picture that is not complete never takes the place of an older one.

    Args:
        file: that describes the mechanism.
        folder: of the pictures; it is made if there is none.
        choice: what to draw.

    Returns:
        A summary of the mechanism, and the paths of the pictures, line by line.

    Raises:
        KinematicsError: if the file describes no mechanism, or not one with such pictures.
        OSError: if the pictures cannot be written.
    """
    content = load_mechanism(file)
    saved: list[str] = []
    with tqdm(total=1, delay=SHOWN_AFTER, mininterval=0.5, unit="step") as bar:
        pictures = pictures_of(content, choice)
        bar.total += len(pictures.figures) + choice.frames
        bar.update()
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder, prefix=".draw_mechanism-") as scratch:
            for name, draw in pictures.figures.items():
                bar.set_description(f"drawing {name}", refresh=False)
                picture = Path(scratch, f"{file.stem}_{name}.png")
                draw().savefig(picture, dpi=RESOLUTION)
                saved.append(str(picture.replace(folder / picture.name)))
                bar.update()
            if choice.frames:
                bar.set_description("drawing the animation", refresh=False)
                picture = Path(scratch, f"{file.stem}_{pictures.movie_name}.gif")
                save_movie(pictures.movie(), picture, bar.update)
                saved.append(str(picture.replace(folder / picture.name)))
    return [*pictures.summary, *saved]


def pictures_of(content: MechanismFile, choice: Choice) -> Pictures:
    """Analyse a mechanism and return what can be drawn of it.

    Raises:
        DrawingError: if the mechanism has no pictures, not the branch, or no position.
        KinematicsError: if it cannot be analysed.
    """
    mechanism = content.mechanism
    if isinstance(mechanism, FMechanism):
        return _of_f_mechanism(mechanism, choice)
    if isinstance(mechanism, FourBar):
        return _of_four_bar(mechanism, content.coupler_point, choice)
    raise DrawingError(f"there are no pictures of a {type(mechanism).__name__}")


def _of_f_mechanism(mechanism: FMechanism, choice: Choice) -> Pictures:
    fewest = max(f_mechanism.FEWEST_SAMPLES, 2 * choice.frames)
    overview = f_mechanism.detailed_overview(mechanism, fewest=fewest)
    if not overview.branches and overview.self_motion.any():
        raise DrawingError(
            "the F-mechanism has no branches: wherever it has positions, the platform can move "
            "while the cranks stand still"
        )
    if not overview.branches and overview.singular_poses:
        raise DrawingError("all positions of the F-mechanism are singular: it has no branches")
    if not overview.branches:
        raise DrawingError("the F-mechanism has no position over any range of crank angles")
    chosen = _main_branch(overview) + 1 if choice.branch is None else choice.branch
    number = _checked_branch(chosen, len(overview.branches))
    crank_angle = choice.crank_angle
    if crank_angle is None:
        crank_angle = f_mechanism.angle_that_is_drawn(overview)
    elif not mechanism.poses(crank_angle):
        raise DrawingError(
            f"the F-mechanism has no position at crank angle {math.degrees(crank_angle):.9g} deg"
        )
    title = f"F-mechanism, branch {number}"
    return Pictures(
        tuple(
            f"branch {index + 1}: {f_mechanism.describe(branch)}"
            + _at([event.crank_angle for event in branch.turning_points])
            + ("; bifurcation" if branch.bifurcations else "")
            + _at([event.crank_angle for event in branch.bifurcations])
            for index, branch in enumerate(overview.branches)
        ),
        {
            "angle": lambda: f_mechanism.angle_figure(overview),
            f"paths_branch_{number}": lambda: f_mechanism.paths_figure(
                mechanism, overview, number - 1
            ),
            "positions": lambda: f_mechanism.positions_figure(mechanism, overview, crank_angle),
            "corners": lambda: f_mechanism.corners_figure(mechanism, overview, crank_angle),
        },
        f"branch_{number}",
        lambda: f_mechanism.f_mechanism_movie(overview.branches[number - 1], title, choice.frames),
    )


def _of_four_bar(linkage: FourBar, coupler_point: tuple[float, float], choice: Choice) -> Pictures:
    branches = tuple(Branch)
    branch = default_branch(linkage)
    if choice.branch is not None:
        branch = branches[_checked_branch(choice.branch, len(branches)) - 1]
    limits = sorted({limit for ends in linkage.crank_ranges for limit in ends})
    crank = "turns fully" if linkage.crank_turns_fully else f"has its limits{_at(limits)}"
    extremes = linkage.transmission_extremes
    if choice.crank_angle is not None:
        linkage.pose(choice.crank_angle, branch)
    return Pictures(
        (
            f"{linkage.grashof_class.value}: the crank {crank}",
            f"transmission angle: {degrees_text(extremes.smallest)} to "
            f"{degrees_text(extremes.largest)}",
        ),
        {
            f"coupler_curve_{branch.value}": lambda: four_bar.coupler_curve_figure(
                linkage, coupler_point, branch, choice.crank_angle
            ),
            "angles": lambda: four_bar.angles_figure(linkage),
        },
        branch.value,
        lambda: four_bar.four_bar_movie(
            linkage, coupler_point, branch, choice.frames, choice.crank_angle
        ),
    )


def _checked_branch(number: int, count: int) -> int:
    if not 1 <= number <= count:
        raise DrawingError(f"branch {number} does not exist: the mechanism has {count}, from 1 on")
    return number


def _main_branch(overview: FMechanismOverview) -> int:
    """Return the index of a branch that turns fully, else of that with the longest crank way."""
    if overview.fully_turning:
        return overview.fully_turning[0]
    ways = [float(np.ptp(branch.crank_angle)) for branch in overview.branches]
    return first_largest(ways)


def _at(crank_angles: list[float]) -> str:
    if not crank_angles:
        return ""
    # A branch that crosses itself reports the place twice.
    places = dict.fromkeys(degrees_text(angle, 3) for angle in crank_angles)
    return f" at crank angle{'' if len(places) == 1 else 's'} " + ", ".join(places)
