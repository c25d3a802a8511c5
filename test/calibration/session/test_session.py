"""The list of measurements as a user makes it."""

from datetime import datetime

import pytest
from full_disk import full_disk

from tri_glide_kinematics.calibration.fit import MachineParameters, Plate, Priors, load_measurements
from tri_glide_kinematics.calibration.session import (
    RecordingError,
    SavingError,
    Session,
    keep_measurements,
    new_session_file,
)
from tri_glide_kinematics.errors import NotFiniteError, OutOfBoundsError
from tri_glide_kinematics.tri_glide import DEFAULT_GEOMETRY

NOW = datetime(2026, 11, 29, 9, 30)
HEIGHTS = (0.4, 0.41, 0.42)
OTHERS = (0.5, 0.51, 0.52)
NOMINAL = MachineParameters(DEFAULT_GEOMETRY)


@pytest.fixture
def session():
    return Session(Plate("bed", 0.1, (0.0, 0.0)))


def test_measurements_are_counted(session):
    assert session.touch(HEIGHTS, 1e-5) == 1
    assert session.touch(HEIGHTS, 2e-5, "glass") == 2
    assert session.position(HEIGHTS, (1.0, 2.0, 3.0), 5e-5, "camera") == 3
    assert session.distance_end(HEIGHTS, 0.0, 6e-5) == 0
    assert session.missing == "the second end of a distance"
    assert session.distance_end(OTHERS, 0.1, 6e-5) == 4
    assert session.missing == ""
    bed, glass, position, distance = session.measurements
    assert (bed.plate.height, glass.plate) == (0.1, Plate("glass", None, None))
    assert [each.standard_deviation for each in session.measurements] == [1e-5, 2e-5, 5e-5, 6e-5]
    assert (position.frame, position.position) == ("camera", (1.0, 2.0, 3.0))
    assert (distance.heights_from, distance.heights_to) == (HEIGHTS, OTHERS)
    assert session.lines() == [
        "1: touch of plate 'bed' ±10 µm at heights (0.4, 0.41, 0.42) m",
        "2: touch of plate 'glass' ±20 µm at heights (0.4, 0.41, 0.42) m",
        "3: position (1, 2, 3) m in frame 'camera' ±50 µm at heights (0.4, 0.41, 0.42) m",
        "4: distance 100 mm ±60 µm from heights (0.4, 0.41, 0.42) to (0.5, 0.51, 0.52) m",
    ]


def test_what_cannot_be_kept_is_not_noted():
    kept = []

    def keep():
        if len(kept) == 2:
            raise SavingError("full")
        kept.append(list(session.measurements))

    session = Session(Plate("bed", 0.1, (0.0, 0.0)), keep)
    session.touch(HEIGHTS, 1e-5)
    session.distance_end(HEIGHTS, 0.0, 6e-5)
    session.touch(OTHERS, 1e-5)
    before = session.lines()
    for change in (
        lambda: session.touch(HEIGHTS, 1e-5),
        lambda: session.distance_end(OTHERS, 0.1, 6e-5),
        lambda: session.drop(1),
        lambda: session.drop(0),
        lambda: session.replace([]),
    ):
        with pytest.raises(SavingError, match="full"):
            change()
        assert session.lines() == before
        assert session.missing == "the second end of a distance"
    assert [len(each) for each in kept] == [1, 2]


def test_a_session_is_kept_while_it_is_made_and_gone_on_with(tmp_path):
    file = new_session_file(tmp_path, NOW)
    session = Session(
        Plate("bed", None, (0.0, 0.01)),
        lambda: keep_measurements(file, session.content(NOMINAL, Priors())),
    )
    session.touch(HEIGHTS, 1e-5)
    session.position(HEIGHTS, (1.0, 2.0, 3.0), 5e-5, "camera")
    session.distance_end(HEIGHTS, 0.0, 6e-5)
    session.distance_end(OTHERS, 0.1, 6e-5)
    read = load_measurements(file)
    again = Session(Plate("bed", 0.1, (0.0, 0.0)))
    again.replace((*read.touches, *read.positions, *read.distances))
    assert again.lines() == session.lines()
    # No session takes the file of another.
    assert new_session_file(tmp_path, NOW) != file
    assert list(tmp_path.iterdir()) == [file]
    with full_disk(100), pytest.raises(SavingError, match="cannot be written: File too large"):
        session.touch(OTHERS, 1e-5)
    assert len(session.measurements) == 3
    assert load_measurements(file) == read


def test_a_first_end_counts_once(session):
    with pytest.raises(RecordingError, match="first end is missing"):
        session.distance_end(HEIGHTS, 0.1, 6e-5)
    session.distance_end(HEIGHTS, 0.0, 6e-5)
    session.distance_end(OTHERS, 0.1, 6e-5)
    with pytest.raises(RecordingError, match="first end is missing"):
        session.distance_end(HEIGHTS, 0.1, 6e-5)


def test_dropping_one_and_all(session):
    for _ in range(3):
        session.touch(HEIGHTS, 1e-5)
    session.touch(OTHERS, 1e-5)
    assert "0.51" in session.drop(4)
    assert session.drop(2).startswith("touch")
    with pytest.raises(RecordingError, match="no measurement 3, only 2"):
        session.drop(3)
    session.distance_end(HEIGHTS, 0.0, 6e-5)
    assert session.drop(0) == "2 measurements"
    assert (session.lines(), session.missing) == ([], "")


def test_numbers_without_a_meaning_are_not_noted(session):
    with pytest.raises(NotFiniteError):
        session.position(HEIGHTS, (float("nan"), 0.0, 0.0), 5e-5)
    with pytest.raises(OutOfBoundsError):
        session.touch(HEIGHTS, -1.0)
    assert session.measurements == []
