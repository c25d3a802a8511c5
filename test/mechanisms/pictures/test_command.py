"""The command draw_mechanism: from a file in config/ to pictures, and its words when it fails."""

import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from PIL import Image

from tri_glide_kinematics.files import find_file
from tri_glide_kinematics.mechanisms import load_mechanism
from tri_glide_kinematics.mechanisms.f_mechanism import FMechanism
from tri_glide_kinematics.mechanisms.pictures import drawing, picture_set
from tri_glide_kinematics.mechanisms.pictures.command import main
from tri_glide_kinematics.mechanisms.pictures.picture_set import Choice, DrawingError, pictures_of

ROOT = Path(__file__).parents[3]
CONFIG = ROOT / "config"
F_MECHANISM = CONFIG / "f_mechanism_example_2.yaml"
FOUR_BAR = CONFIG / "four_bar_sheet.yaml"
COMMAND = (
    "import sys; from tri_glide_kinematics.mechanisms.pictures.command import main;"
    " sys.exit(main())"
)


ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def run(script, *arguments):
    """Run Python in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", script, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=60,
        env=ENVIRONMENT,
    )


def draw(capsys, *arguments):
    """Run in this process; return exit code, lines of stdout and of stderr."""
    try:
        code = main([*map(str, arguments)])
    except SystemExit as exit:
        code = exit.code
    captured = capsys.readouterr()
    return code, captured.out.splitlines(), captured.err.splitlines()


@pytest.mark.slow
def test_an_f_mechanism_gets_all_its_pictures(tmp_path, capsys):
    folder = tmp_path / "a new" / "folder"
    code, out, _ = draw(
        capsys, F_MECHANISM, "--output", folder, "--crank-angle", 146, "--animate", "--frames", 2
    )
    assert code == 0
    names = ["angle.png", "paths_branch_2.png", "positions.png", "corners.png", "branch_2.gif"]
    files = [folder / f"f_mechanism_example_2_{name}" for name in names]
    assert out == [
        "branch 1: 4 turning points at crank angles 169.594°, 135.044°, 294.189°, 250.223°",
        "branch 2: turns fully",
        *map(str, files),
    ]
    assert sorted(folder.iterdir()) == sorted(files)
    for file in files:
        with Image.open(file) as image:
            assert min(image.size) > 250
            assert getattr(image, "n_frames", 1) == (2 if file.suffix == ".gif" else 1)


@pytest.mark.parametrize("file", sorted(CONFIG.glob("f*_*.yaml")), ids=lambda file: file.stem)
def test_every_branch_of_every_mechanism_in_config_has_its_pictures(file):
    content = load_mechanism(file)
    for branch in (1, 2) if "four_bar" in file.stem or "2" in file.stem else (1,):
        drawn = pictures_of(content, Choice(branch, None, 3))
        assert len(drawn.movie().points) == 3
        assert len([drawing() for drawing in drawn.figures.values()]) in (2, 4)


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["nothing.yaml"], 1, "nothing.yaml: cannot be read"),
        ([CONFIG], 1, "cannot be read"),
        ([CONFIG / "tri_glide.yaml"], 1, "no kind of mechanism"),
        ([CONFIG / "landing_gear.yaml"], 1, "no pictures of a LandingGear"),
        ([F_MECHANISM, "--branch", 3], 1, "branch 3 does not exist: the mechanism has 2"),
        ([F_MECHANISM, "--branch", 0], 1, "branch 0 does not exist: the mechanism has 2"),
        ([FOUR_BAR, "--branch", -1], 1, "branch -1 does not exist: the mechanism has 2"),
        ([CONFIG / "f_mechanism_example_1.yaml", "--crank-angle", 300], 1, "no position at crank"),
        ([FOUR_BAR, "--crank-angle", 200], 1, "beyond the crank's limits"),
        ([], 2, "required: file"),
        ([FOUR_BAR, "--branch", "one"], 2, "invalid int value: 'one'"),
        ([FOUR_BAR, "--crank-angle", "nan"], 2, "'nan' is not a finite number"),
        ([FOUR_BAR, "--crank-angle", "x"], 2, "'x' is not a finite number"),
        ([FOUR_BAR, "--frames", 1], 2, "'1' is not a whole number from 2 to 720"),
        ([FOUR_BAR, "--frames", "1e3"], 2, "'1e3' is not a whole number from 2 to 720"),
    ],
)
def test_mistakes_get_one_clear_line(monkeypatch, capsys, tmp_path, arguments, code, reason):
    monkeypatch.setattr(sys, "argv", ["draw_mechanism"])
    got, out, err = draw(capsys, *arguments, "--output", tmp_path / "out")
    assert got == code and out == []
    assert err[-1].startswith("draw_mechanism: error: ") and reason in err[-1]
    assert len([line for line in err if "%" not in line]) == 1 or code == 2
    assert not (tmp_path / "out").exists()


def test_a_mechanism_that_moves_by_itself_is_refused(capsys, tmp_path):
    file = tmp_path / "parallel.yaml"
    file.write_text(
        "f_mechanism:\n"
        "  base: [[0, 0], [1, 0], [0.3, 0.8]]\n"
        "  platform: [[0, 0], [1, 0], [0.3, 0.8]]\n"
        "  crank_lengths: [0.2, 0.2, 0.2]\n"
        "  rod_lengths: [0.5, 0.5, 0.5]\n"
    )
    code, _, err = draw(capsys, file, "--output", tmp_path)
    assert code == 1 and "the platform can move while the cranks stand still" in err[-1]


def test_a_mechanism_without_branches_is_refused(monkeypatch):
    content = load_mechanism(F_MECHANISM)
    overview = replace(content.mechanism.overview(), branches=())
    monkeypatch.setattr(FMechanism, "overview", lambda *_: overview)
    with pytest.raises(DrawingError, match="no position over any range of crank angles"):
        pictures_of(content, Choice(None, None, 0))
    overview = replace(overview, singular_poses=content.mechanism.poses(0.0))
    with pytest.raises(DrawingError, match="all positions of the F-mechanism are singular"):
        pictures_of(content, Choice(None, None, 0))


def test_a_folder_that_cannot_be_written_is_named(capsys, tmp_path):
    occupied = tmp_path / "file"
    occupied.write_text("")
    for folder in (occupied, occupied / "below"):
        code, _, err = draw(capsys, FOUR_BAR, "--output", folder)
        assert code == 1
        assert err[-1].startswith(f"draw_mechanism: error: cannot write to {folder}: ")


def test_an_interrupted_run_leaves_older_pictures_alone(capsys, tmp_path, monkeypatch):
    older = tmp_path / "four_bar_sheet_open.gif"
    older.write_text("older")

    def interrupt(movie, file, on_frame):
        file.write_text("half")
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(picture_set, "save_movie", interrupt)
    monkeypatch.setattr(Figure, "savefig", lambda _, file, **__: file.touch())
    arguments = (FOUR_BAR, "--output", tmp_path, "--animate", "--branch", 1)
    handler = signal.getsignal(signal.SIGINT)
    code, out, err = draw(capsys, *arguments)
    assert (code, out) == (130, []) and err[-1] == "draw_mechanism: interrupted"
    assert signal.getsignal(signal.SIGINT) is handler
    assert older.read_text() == "older"
    assert {file.suffix for file in tmp_path.iterdir()} == {".png", ".gif"}
    assert drawing.save_movie is not interrupt


def test_an_installed_mechanism_is_found_by_its_name(tmp_path, monkeypatch):
    share = tmp_path / "prefix" / "share" / "tri_glide_kinematics" / "config"
    share.mkdir(parents=True)
    shutil.copy(FOUR_BAR, share)
    prefixes = os.pathsep.join([str(tmp_path / "other"), str(tmp_path / "prefix")])
    monkeypatch.setenv("AMENT_PREFIX_PATH", prefixes)
    monkeypatch.chdir(tmp_path)
    assert find_file(Path(FOUR_BAR.name)) == share / FOUR_BAR.name
    assert find_file(Path("missing.yaml")) == Path("missing.yaml")
    assert find_file(Path("folder", FOUR_BAR.name)) == Path("folder", FOUR_BAR.name)
    Path(FOUR_BAR.name).write_text("mine")
    assert find_file(Path(FOUR_BAR.name)) == Path(FOUR_BAR.name)


@pytest.mark.slow
def test_a_four_bar_linkage_gets_its_pictures_without_ros(tmp_path):
    script = f"""if True:
        import sys
        from tri_glide_kinematics.mechanisms.pictures.command import main
        assert not any(name.startswith(("numpy", "matplotlib")) for name in sys.modules)
        assert main([{str(FOUR_BAR)!r}, "--output", {str(tmp_path)!r}, "--branch", "1"]) == 0
        print([name for name in sys.modules if name.startswith(("rclpy", "ament", "tkinter"))])
    """
    done = run(script)
    assert done.returncode == 0, done.stderr
    first, *_, last = done.stdout.splitlines()
    assert first == (
        "double rocker: the crank has its limits at crank angles "
        "29.607°, 119.252°, 234.327°, 323.972°"
    )
    assert last == "[]"
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "four_bar_sheet_angles.png",
        "four_bar_sheet_coupler_curve_open.png",
    ]


def test_a_missing_module_is_named():
    script = COMMAND.replace("import sys; ", "import sys; sys.modules['matplotlib'] = None; ")
    done = run(script, FOUR_BAR)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("draw_mechanism: error: the Python module 'matplotlib")
