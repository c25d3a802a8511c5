"""Directions of the twelve parameters in words, for what data cannot know."""

from __future__ import annotations

import numpy as np

from tri_glide_kinematics.calibration.fit.machine import PARAMETER_NAMES
from tri_glide_kinematics.vectors import FloatArray

# A direction is named if this part of it (of the square of its length) is not determined.
MOSTLY = 0.8
# Of a direction without a name, parameters with less than this part of the largest are left out.
SMALL_PART = 0.5
# Directions with less than this left, after those with a name are taken out, are rounding.
NOTHING = 0.3


def named_directions(machine: FloatArray) -> dict[str, FloatArray]:
    """Return directions with a meaning, each of shape (12,).

    Scale and size come with the height offsets that hold the platform where it is in the middle;
    tilting is about the mean of the carriages then.
    """
    anchors, lengths = machine[:6].reshape(3, 2), machine[6:9]
    arms = anchors - anchors.mean(axis=0)
    squares = np.square(arms).sum(axis=1)
    rises = np.sqrt(np.maximum(np.square(lengths) - squares, 1e-12))
    higher = rises - rises.mean()
    none, ones = np.zeros(3), np.ones(3)
    first, last = np.array([1.0, -1.0, 0.0]), np.array([0.0, 1.0, -1.0])
    level = np.zeros((3, 2))
    across = np.column_stack((-arms[:, 1], arms[:, 0]))

    def direction(anchor: FloatArray, arm: FloatArray, offset: FloatArray) -> FloatArray:
        return np.concatenate((anchor.ravel(), arm, offset))

    along_x, along_y = np.tile((1.0, 0.0), (3, 1)), np.tile((0.0, 1.0), (3, 1))
    return {
        "shifting along x": direction(along_x, none, none),
        "shifting along y": direction(along_y, none, none),
        "turning about z": direction(across, none, none),
        "shifting along z (all height offsets together)": direction(level, none, ones),
        "tilting about x": direction(-along_y * higher[:, None], none, arms[:, 1]),
        "tilting about y": direction(-along_x * higher[:, None], none, arms[:, 0]),
        "the common scale of anchors and arms": direction(arms, lengths, rises),
        "the size of the anchors' triangle": direction(arms, none, -squares / rises),
        "stretching the anchors' triangle along y and not along x": direction(
            arms * (-1.0, 1.0),
            none,
            (np.square(arms[:, 0]) - np.square(arms[:, 1])) / rises,
        ),
        "the difference between arms 1 and 2": direction(level, first, first * lengths / rises),
        "the difference between arms 2 and 3": direction(level, last, last * lengths / rises),
        "shearing the anchors' triangle": direction(
            arms[:, ::-1], none, -2.0 * arms[:, 0] * arms[:, 1] / rises
        ),
    }


def along_named(machine: FloatArray, scale: FloatArray, change: FloatArray) -> dict[str, float]:
    """Return how far a change goes along each direction with a meaning.

    Args:
        machine: about which the directions are. Shape (12,) [m].
        scale: machine = mean + scale u. Shape (12, 12).
        change: of u. Shape (12,).
    """
    found = {}
    for name, direction in named_directions(machine).items():
        unit = np.linalg.solve(scale, direction)
        found[name] = float(unit @ change / np.linalg.norm(unit))
    return found


def in_words(machine: FloatArray, scale: FloatArray, unknown: FloatArray) -> tuple[str, ...]:
    """Return the names of the directions that are not determined.

    Args:
        machine: about which the directions are. Shape (12,) [m].
        scale: machine = mean + scale u. Shape (12, 12).
        unknown: directions of u, columns at right angles to each other. Shape (12, m).
    """
    names = []
    rest = unknown
    for name, direction in named_directions(machine).items():
        if not rest.shape[1]:
            break
        unit = np.linalg.solve(scale, direction)
        unit /= np.linalg.norm(unit)
        inside = unknown.T @ unit
        if inside @ inside < MOSTLY:
            continue
        # Take it out of what is left; a direction that is in there no more says nothing new.
        part = rest.T @ unit
        length = float(np.linalg.norm(part))
        if length < NOTHING:
            continue
        names.append(name)
        kept = np.linalg.svd(part[None, :] / length)[2][1:]
        rest = rest @ kept.T
    return (*names, *(_combination(scale @ column) for column in rest.T))


def _combination(change: FloatArray) -> str:
    """Return which parameters a direction without a name changes most."""
    largest = np.abs(change).max()
    parts = [
        PARAMETER_NAMES[i] for i in range(len(change)) if abs(change[i]) > SMALL_PART * largest
    ]
    return f"a combination of {', '.join(parts)}"
