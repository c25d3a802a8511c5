"""Programs before they run: how they are drawn, and what is told of those that are wrong."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from testing.waiting import wait_until
from tri_glide_kinematics.motion import SliderLimits
from tri_glide_kinematics.panel.program_reading import (
    CHORD_ANGLE,
    CUT,
    MOST_DRAWN,
    OUTSIDE,
    RAPID,
    NotRead,
    Reading,
    ReadingProcess,
    ReadProgram,
    answer_to,
    line_starts,
    mark_of,
    points_of_line,
    thinned_out,
)
from tri_glide_kinematics.programs import PathRun, ProgramCheck, ProgramSettings
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY, TriGlide
from tri_glide_kinematics.workspace import Workspace, WorkspaceLimits

TRI_GLIDE = TriGlide(DEFAULT_GEOMETRY)
WORKSPACE = Workspace(TRI_GLIDE, WorkspaceLimits((0.3,) * 3, (0.9,) * 3, 0.005, 10.0))
LIMITS = SliderLimits.uniform(1.0, 10.0, 200.0)
SETTINGS = ProgramSettings(start=(0.0, 0.0, 0.3))
PART = b"G21 G90 G17\r\nG0 X30 Z300\r\nG3 X-30 Z310 I-30 F1000\r\nG1 X0\r\nM2\r\n"


def reading(folder: Path, text: bytes, *, is_check: bool = False) -> Reading:
    file = folder / "part.ngc"
    if not file.exists() or file.read_bytes() != text:
        file.write_bytes(text)
    return Reading(file, SETTINGS, WORKSPACE, LIMITS, None, is_check, mark_of(file))


def read(folder: Path, text: bytes) -> ReadProgram:
    answer = answer_to(reading(folder, text))
    assert isinstance(answer, ReadProgram)
    return answer


def test_rapid_moves_and_cuts_are_told_apart_and_arcs_are_on_their_helix(tmp_path: Path) -> None:
    part = read(tmp_path, PART)
    assert set(part.looks.tolist()) == {CUT, RAPID}
    assert not part.outside
    assert part.points[0, 0] == pytest.approx((0.0, 0.0, 0.3))
    # One piece begins where the one before it ends.
    assert part.points[1:, 0] == pytest.approx(part.points[:-1, 1])
    assert (part.lower, part.upper) == (
        pytest.approx((-0.03, 0.0, 0.3)),
        pytest.approx((0.03, 0.03, 0.31), abs=1e-9),
    )
    (run,) = [step for step in part.program.steps if isinstance(step, PathRun)]
    arc = points_of_line(run, 3)
    assert np.hypot(arc[:, 0], arc[:, 1]) == pytest.approx(0.03)
    angles = np.arctan2(arc[:, 1], arc[:, 0])
    assert np.diff(angles).max() <= CHORD_ANGLE * (1.0 + 1e-9)
    assert arc[:, 2] == pytest.approx(0.3 + 0.01 * angles / np.pi)
    assert points_of_line(run, 4)[[0, -1], 0] == pytest.approx((-0.03, 0.0))
    assert not len(points_of_line(run, 5))


def test_the_steps_of_a_line_are_found(tmp_path: Path) -> None:
    text = b"G21\nM3 S500\nG1 X1 Z300 F600\nM62 P2 X2\nM8\nX3\nM65 P2\nG4 P1\n(a)\nX4 M0\nM5\nM2\n"
    part = read(tmp_path, text)
    for line in range(part.program.lines + 2):
        expected = [
            index
            for index, step in enumerate(part.program.steps)
            if step.line_at() <= line <= step.line_at(-1)
        ]
        assert list(part.steps_at(line)) == expected
        # What comes behind them begins later.
        behind = part.program.steps[part.steps_at(line).stop :]
        assert all(step.line_at() > line for step in behind)


def test_what_is_outside_is_red_from_the_edge_on(tmp_path: Path) -> None:
    part = read(tmp_path, b"G21 G90\nG1 X10 Z300 F600\nG1 X900\nG1 X0\nM2\n")
    assert part.outside == 3
    red = part.points[part.looks == OUTSIDE]
    edge = WORKSPACE.exit_distance((0.01, 0.0, 0.3), (1.0, 0.0, 0.0), 1.0)
    assert red[:, :, 0].min() == pytest.approx(0.01 + edge, abs=0.006)


def test_many_pieces_are_thinned_out_and_corners_stay() -> None:
    way = np.arange(300_001) * 1e-4
    points = np.column_stack((way % 0.1, 0.01 * np.floor(way / 0.1), np.sin(20.0 * way)))
    looks = np.zeros(len(way) - 1, dtype=np.uint8)
    looks[100_000:] = RAPID
    kept = thinned_out(points, looks)
    assert kept[0] == 0
    assert kept[-1] == len(way) - 1
    assert 100_000 in kept
    assert len(kept) <= MOST_DRAWN + 3
    drawn = np.column_stack([np.interp(way, way[kept], points[kept, axis]) for axis in range(3)])
    # Farther away only in the short steps back to the start of a row.
    apart = np.linalg.norm(drawn - points, axis=1)
    assert np.quantile(apart, 0.99) < 1e-3


@pytest.mark.parametrize("text", [b"", b"\n", b"a", b"a\n\nb", b"a\r\nb\rc\n", b"\r\r\n\n\xff\0\n"])
def test_lines_begin_where_those_of_the_program_do(text: bytes) -> None:
    starts = line_starts(text)
    lines = [text[begin:end] for begin, end in itertools.pairwise(starts)]
    assert lines == text.splitlines(keepends=True)


@pytest.mark.parametrize(
    ("text", "reason", "line"),
    [
        (b"G21\nG1 X0 Y0 Z300 F500\nG1 Xten\n", "part.ngc: line 3, column 4", 3),
        (bytes(1000), "part.ngc: is no text in UTF-8", 0),
        (b"(nothing)\n", "nothing that can be done", 0),
    ],
)
def test_a_program_that_is_wrong_tells_its_line(
    tmp_path: Path, text: bytes, reason: str, line: int
) -> None:
    answer = answer_to(reading(tmp_path, text))
    assert isinstance(answer, NotRead)
    assert reason in answer.reason
    assert answer.reason.isprintable()
    assert len(answer.reason) < 600
    assert answer.line == line


def test_a_file_that_is_gone_is_told(tmp_path: Path) -> None:
    gone = reading(tmp_path, PART)
    gone.file.unlink()
    assert answer_to(gone) == NotRead("part.ngc cannot be read: No such file or directory")


def test_another_file_in_place_of_the_one_that_is_meant_is_not_read(tmp_path: Path) -> None:
    meant = reading(tmp_path, PART, is_check=True)
    (tmp_path / "new.ngc").write_bytes(PART.replace(b"Z310", b"Z305"))
    (tmp_path / "new.ngc").replace(meant.file)
    assert answer_to(meant) == NotRead("part.ngc was changed while it was read")


def test_a_process_reads_and_proves_and_can_be_ended(tmp_path: Path) -> None:
    processes = [
        ReadingProcess(reading(tmp_path, PART)),
        ReadingProcess(reading(tmp_path, PART, is_check=True)),
        ReadingProcess(reading(tmp_path, PART)),
    ]
    processes[-1].end()
    wait_until(lambda: all(process.answer is not None for process in processes), "answers", 0.01)
    drawn, check, ended = (process.answer for process in processes)
    assert isinstance(drawn, ReadProgram)
    assert drawn.points == pytest.approx(read(tmp_path, PART).points)
    assert isinstance(check, ProgramCheck)
    assert check.length == pytest.approx(0.03 + np.hypot(0.03 * np.pi, 0.01) + 0.03, rel=1e-3)
    assert ended == NotRead("part.ngc: nothing came of it (exit code -9)")


@pytest.mark.parametrize("is_check", [False, True])
def test_how_far_the_work_is_grows_to_its_end(tmp_path: Path, *, is_check: bool) -> None:
    way = np.arange(4_000)
    lines = [f"G1 X{20 * np.sin(0.01 * k):.4f} Y{20 * np.cos(0.01 * k):.4f}" for k in way]
    text = "\n".join(["G21 G90 F1000", "G1 Z300", *lines, "M2", ""]).encode()
    parts: list[float] = []
    answer_to(reading(tmp_path, text, is_check=is_check), parts.append)
    assert 0.0 < parts[0] < 0.7
    assert np.diff(parts).min() >= 0.0
    assert 0.7 < parts[-1] <= 1.0
    # The process tells it while it goes on, and a cancel ends it at once.
    process = ReadingProcess(reading(tmp_path, text.replace(b"M2\n", b"") * 40, is_check=is_check))
    wait_until(lambda: process.part or process.answer, "some of the work", 0.01)
    assert process.answer is None
    process.end()
    wait_until(lambda: process.answer, "its end", 0.01)
    assert isinstance(process.answer, NotRead)
