"""What is kept on disk of how far a program came."""

from dataclasses import replace

import pytest

from tri_glide_kinematics.programs import (
    KeptError,
    KeptLine,
    RunState,
    default_kept_file,
    line_to_go_on_from,
    load_kept,
    load_program,
)


@pytest.fixture
def program(tmp_path):
    file = tmp_path / "part.ngc"
    file.write_text("G0 X1\nX2\nX3\nM2\n")
    return load_program(file)


def test_what_is_written_is_read(program, tmp_path):
    file = tmp_path / "new" / "folder" / "kept.yaml"
    told = KeptLine.of(program, 2, RunState.WAITING)
    told.write(file)
    assert load_kept(file) == told
    assert line_to_go_on_from(file, program) == 2


def test_a_file_that_has_changed_is_refused(program, tmp_path):
    file = tmp_path / "kept.yaml"
    KeptLine.of(program, 2, RunState.STOPPING).write(file)
    part = tmp_path / "part.ngc"
    part.write_text("G0 X1\nX2\nX4\nM2\n")
    with pytest.raises(KeptError, match=r"part.ngc has changed since .* line 2: choose"):
        line_to_go_on_from(file, load_program(part))
    other = tmp_path / "other.ngc"
    other.write_text("G0 X1\nM2\n")
    with pytest.raises(KeptError, match=r"driven last is .*part.ngc, not .*other.ngc"):
        line_to_go_on_from(file, load_program(other))


def test_a_program_that_was_driven_to_its_end_does_not_go_on(program, tmp_path):
    file = tmp_path / "kept.yaml"
    KeptLine.of(program, 4, RunState.ENDED, is_whole=True).write(file)
    with pytest.raises(KeptError, match="has been driven to its end"):
        line_to_go_on_from(file, program)


def wrong_lines(whole):
    return [whole.replace("line: 4", f"line: {wrong}") for wrong in ("x", "0", "2.5", "-1")]


def test_what_cannot_be_read_is_an_error(program, tmp_path):
    file = tmp_path / "kept.yaml"
    with pytest.raises(KeptError, match=r"kept.yaml: .*No such file"):
        line_to_go_on_from(file, program)
    KeptLine.of(program, 4, RunState.ENDED).write(file)
    whole = file.read_text()
    for wrong in ("", whole.replace("ended", "gone"), *wrong_lines(whole)):
        file.write_text(wrong)
        with pytest.raises(KeptError, match=r"kept\.yaml"):
            load_kept(file)


def test_each_machine_has_a_file_of_its_own(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    folder = tmp_path / "tri_glide_kinematics"
    assert default_kept_file("/") == folder / "program_progress.yaml"
    assert default_kept_file("/hall/cell_1") == folder / "program_progress_hall_cell_1.yaml"


def test_a_write_that_fails_leaves_what_was_there(program, tmp_path):
    file = tmp_path / "kept.yaml"
    told = KeptLine.of(program, 2, RunState.RUNNING)
    told.write(file)
    with pytest.raises(OSError):
        replace(told, line=3).write(file / "below")
    assert load_kept(file) == told
