"""The questions of the tab for each kind of mechanism, and the kind of each file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from tri_glide_kinematics.mechanisms import MechanismFile, MechanismFileError, load_mechanism
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism
from tri_glide_kinematics.mechanisms.four_bar import FourBar
from tri_glide_kinematics.panel.mechanisms.dimensions import Dimension
from tri_glide_kinematics.panel.mechanisms.f_mechanism import FMechanismQuestions
from tri_glide_kinematics.panel.mechanisms.four_bar import FourBarQuestions
from tri_glide_kinematics.panel.mechanisms.picture import Branch, Position
from tri_glide_kinematics.vectors import FloatArray


class Questions(Protocol):
    """Requests about one mechanism, and what is drawn of the answers.

    Attributes:
        dimensions: what a person may change; ``values`` below are theirs, in [m] and [rad].
        crank_angle: to start from [rad].
        key: of the position to start from.
    """

    dimensions: tuple[Dimension, ...]
    crank_angle: float
    key: float

    @property
    def solve_service(self) -> Any:
        """Type of the service that gives all positions at a crank angle."""

    @property
    def trace_service(self) -> Any:
        """Type of the service that follows a branch."""

    def pivots(self, values: Sequence[float]) -> FloatArray:
        """Return the joints that do not move. Shape (k, 2) [m]."""

    def solve_request(self, values: Sequence[float], crank_angle: float) -> Any:
        """Ask for all positions at a crank angle [rad]."""

    def positions(self, answer: Any) -> tuple[Position, ...]:
        """Return the positions of an answer."""

    def distance(self, key: float, other: float) -> float:
        """Return how far apart two positions at one crank angle are."""

    def trace_request(
        self, values: Sequence[float], crank_angle: float, key: float, answer: Any
    ) -> Any:
        """Ask for the branch of the position ``key`` that was answered at a crank angle [rad]."""

    def branch(self, request: Any, answer: Any) -> Branch | None:
        """Return the branch of an answer, or none if it is a single position."""


def questions_about(file: MechanismFile) -> Questions | None:
    """Return the questions about the mechanism of a file, or none if it is not a planar one."""
    if isinstance(file.mechanism, FourBar):
        return FourBarQuestions(file, file.mechanism)
    if isinstance(file.mechanism, FMechanism):
        return FMechanismQuestions(file.mechanism)
    return None


def example_files(folder: Path) -> dict[str, MechanismFile]:
    """Return the planar mechanisms of a folder by the names of their files."""
    files = {}
    for path in sorted(folder.glob("*.yaml")):
        try:
            file = load_mechanism(path)
        except MechanismFileError:
            # A file of something else: parameters of nodes, or a drive.
            continue
        if isinstance(file.mechanism, FourBar | FMechanism):
            files[path.stem] = file
    return files
