"""How commands answer a mistake: with an exit code, a line that names it, and no file."""

import shlex
import sys
from importlib import import_module
from pathlib import Path

import pytest

from tri_glide_kinematics.command_line import COMMANDS

CONFIG = Path(__file__).parents[2] / "config"
FILES = {
    "parsec.yaml": "unit: parsec",
    "anchors.yaml": "unit: mm\nnominal: {anchors: [[0, 200]], arm_lengths: [1, 2, 3]}",
    "travel.yaml": "/**:\n  ros__parameters:\n    lower_heights: [0.3, 0.9, 0.3]\n",
    "cramped.yaml": "/**:\n  ros__parameters:\n    max_condition_number: 1.5\n",
    "frame.yaml": "frame: table\nsteps:\n- move: {to: [0, 0, 0.2]}\n- move: {to: [0, 0, 0.25]}\n",
    "rest.nc": "M2\n",
    "tilted.g": "M665 L200 R100 H200\nM666 B0.1\n",
    "far.nc": "G1 X1 F100\nX1000\nM2\n",
    "long.nc": "G1 X1 F100\nG4 P60\nM2\n",
    "short.nc": "G1 X1 F100\nM2\n",
    "twice.nc": "G0 X1\nG1 X2 X3 F600\nM2\n",
    "swing_1.csv": "0.0, 0.0\n",
}
SWING = "config/ringdown_example.csv"
TOUCHES = "config/measurements_example.yaml"
DRAWN = "--output . --parameters config/tri_glide.yaml --settings config/program_settings.yaml"
CHECKED = "--check --parameters config/tri_glide.yaml --settings config/program_settings.yaml"
MACHINE = "config/tri_glide.yaml"
MOTION = "--speed 1 --acceleration 9"


@pytest.fixture
def answer(tmp_path, monkeypatch, capsys):
    """Return a function that runs a command line: it returns exit code and errors."""
    (tmp_path / "config").symlink_to(CONFIG)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    before = set(tmp_path.iterdir())

    def run(line):
        name, *arguments = shlex.split(line)
        monkeypatch.setattr(sys, "argv", [name, *arguments])
        try:
            code = import_module(f"tri_glide_kinematics.{COMMANDS[name].module}").main()
        except SystemExit as end:
            code = end.code
        assert set(tmp_path.iterdir()) == before
        return code, capsys.readouterr().err

    return run


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("calibrate parsec.yaml --output out", "parsec"),
        ("calibrate anchors.yaml --output out", "anchors"),
        ("calibrate none.yaml --output out", "No such file"),
        (f"calibrate {TOUCHES} --output parsec.yaml", "cannot write to"),
        ("ringdown none.csv", "none.csv: cannot be read: No such file"),
        (f"ringdown {SWING} --from 99", "from 99 to inf s there are 0 samples"),
        (f"ringdown {SWING} --picture /proc/no/p.png", "cannot write to /proc/no: No such file"),
        (f"ringdown {SWING} --write /proc/no/m.yaml", "/proc/no/m.yaml: cannot be written"),
        (f"draw_motion rest.nc {DRAWN}", "nothing in it moves"),
        (f"draw_motion far.nc {DRAWN}", "line 2"),
        (f"draw_motion long.nc {DRAWN} --rate 100000", "name a lower --rate"),
        (f"draw_motion short.nc {DRAWN} --settings none.yaml", "none.yaml: cannot be read"),
        (f"draw_motion frame.yaml {DRAWN}", "in the frame table"),
        (f"drive twice.nc {CHECKED}", "twice.nc: line 2, column 7: X3: X stands twice"),
        (f"drive far.nc {CHECKED}", "far.nc: line 2: "),
        (
            f"drive short.nc {CHECKED} --parameters none.yaml",
            "none.yaml: cannot be read: No",
        ),
        ("judge none.csv --parameters config/tri_glide.yaml", "cannot be read"),
        (f"size --cylinder 0.1 -0.1 {MOTION}", "cylinder z_max"),
        ("size --box 0.1 0.1 0.1 --speed 0 --acceleration 9", "speed = 0"),
        (f"size --cylinder 0.1 0.12 {MOTION} --drive /nowhere.yaml", "nowhere.yaml"),
        ("draw_machine none.yaml --output .", "none.yaml"),
        ("draw_machine cramped.yaml --output .", "the platform may be nowhere"),
        ("convert none.cfg", "none.cfg: cannot be read: No such file"),
        ("convert rest.nc", "whose settings?"),
        ("convert tilted.g --output out.yaml", "tilted.g: line 2: M666 B = 0.1 must be 0"),
        ("convert none.yaml --to klipper", "none.yaml"),
        ("convert tilted.g --from klipper", "tilted.g"),
        ("describe_machine none.yaml", "none.yaml"),
        ("describe_machine travel.yaml", "lower_heights[1]"),
        (f"draw_machine {MACHINE} --output . --stl /proc/no", "cannot write to /proc/no: "),
        (f"describe_machine {MACHINE} --urdf /dev/null", "cannot write to /dev/null: it is there"),
        (f"draw_motion short.nc {DRAWN} --csv short.nc", "short.nc: is read: write to another"),
        (f"draw_machine {MACHINE} --output . --glb {MACHINE}", f"{MACHINE}: is read: "),
        (f"describe_machine {MACHINE} --mjcf ./{MACHINE}", f"{MACHINE}: is read: "),
        (f"ringdown {SWING} --picture {SWING}", f"{SWING}: is read: "),
        ("ringdown swing_1.csv swing_1.csv --picture swing.csv", "swing_1.csv: is read: "),
        (f"size --cylinder 0.1 0.12 {MOTION} --write rest.nc", "cannot write to rest.nc: it is"),
    ],
)
def test_a_mistake_gets_one_line(answer, line, words):
    name = line.split()[0]
    code, error = answer(line)
    # Of a recording, 1 tells that limits are not kept.
    assert code == (2 if name == "judge" else 1)
    assert error.startswith(f"{name}: error: ")
    assert words in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (f"calibrate {TOUCHES} --next -1", "from 0 to 100"),
        (f"calibrate {TOUCHES} --next 101", "from 0 to 100"),
        (f"calibrate {TOUCHES} --next many", "from 0 to 100"),
        ("ringdown", "either files, or --machine"),
        (f"ringdown {SWING} --machine", "either files, or --machine"),
        (f"ringdown {SWING} --heights", "--heights is for --machine"),
        (f"ringdown {SWING} --from soon", "--from"),
        ("drive program_example.gcode --approach 0", "--approach is 0, must be at least 0.01 mm/s"),
        (f"ringdown {SWING} --to nan", "--to"),
        (f"ringdown {SWING} --shaper best", "--shaper"),
        ("draw_motion short.nc --rate 0", "--rate: '0' is not a number of hertz greater than 0"),
        ("draw_motion short.nc --rate .5", "--rate 0.5: must be from 1 to 100000 Hz"),
        ("draw_machine a.yaml --resolution 0", "--resolution: '0' is not a number of metres"),
        ("describe_machine a.yaml --rod-distance 0", "--rod-distance: '0' is not a number of"),
        ("identify", "either a recording, or --excite"),
        ("identify run.csv --excite b.yaml", "either a recording, or --excite"),
        ("identify run.csv --any-arms --write b.yaml", "--write is for uniform arms"),
        ("identify run.csv --known 'arm 1'", "'arm 1' is not a name, =, and a number"),
        ("identify run.csv --known 'arm 1=much'", "'arm 1=much' is not a name, =, and a number"),
        ("identify run.csv --duration 10", "--duration is for"),
        ("identify --excite b.yaml --duration 0", "'0' is not a number of seconds greater than 0"),
        ("identify --excite b.yaml --known 'arm 1=1'", "--known is for"),
        ("drive steps.yaml --settings a.yaml", "--settings is for programs"),
        ("drive steps.yaml --optional-stops", "--optional-stops is for programs"),
        ("drive steps.yaml --from 3", "--from is for programs"),
        ("drive part.nc --unit m", "--unit is for points: their names end in .csv"),
        ("drive part.nc --from 0", "--from is 0, must be at least 1"),
        ("drive part.csv --from -7 --check", "--from is -7, must be at least 1"),
        ("drive part.nc --parameters a.yaml", "--parameters is for --check"),
        ("drive part.nc --check --go-on", "--go-on is not for --check"),
        ("drive part.nc --from 3 --go-on", "not allowed with"),
    ],
)
def test_options_that_mean_nothing_or_would_be_ignored_are_refused(answer, line, words):
    code, error = answer(line)
    assert code == 2
    assert words in error
