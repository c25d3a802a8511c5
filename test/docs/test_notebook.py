"""The notebook of the examples can be run from its first cell to its last."""

import json
from pathlib import Path

import matplotlib

NOTEBOOK = Path(__file__).parents[2] / "examples" / "mathematics.ipynb"


def test_every_cell_of_the_notebook_runs(capsys):
    matplotlib.use("Agg")
    book = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    assert (book["nbformat"], book["nbformat_minor"]) == (4, 5)
    cells = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
    names: dict[str, object] = {}
    for cell in cells:
        # What a run leaves would be a change of the file with each run.
        assert (cell["execution_count"], cell["outputs"]) == (None, [])
        code = "".join(cell["source"])
        exec(compile(code, f"{NOTEBOOK.name}: {cell['id']}", "exec"), names)
    pyplot = names["plt"]
    assert len(pyplot.get_fignums()) == 2
    pyplot.close("all")
    told = capsys.readouterr().out
    assert "the same position again: True" in told
    assert "OPEN: coupler 88.837 degrees, rocker 117.286 degrees, -3.992 rad/s" in told
