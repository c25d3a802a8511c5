"""Tables of numbers: what they mean, and where a mistake in them is."""

import numpy as np
import pytest

from tri_glide_kinematics.tables import TableError, read_table


@pytest.fixture
def table(tmp_path):
    def read(text, **options):
        file = tmp_path / "table.csv"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_table(file, **options)

    return read


@pytest.mark.parametrize(
    "text",
    [
        "x [mm], y (m)\n1.25, 2\n3, 4e-3\n",
        "# a remark\r\nX[mm];Y (m)\r\n\r\n1.25;2\r\n3;4e-3\n# the end",
        'x [mm]\t"y [m]"\n1.25\t2\n# one more\n3\t4e-3\n',
        "\ufeffx[mm]  y[m]\n1.25  2\n3 4e-3\n\n  ",
        b"# \xb0 in Latin-1, CR alone\rx [mm],y [m]\r1.25,2\r3,4e-3\r",
    ],
)
def test_all_ways_to_write_it_are_the_same_table(table, text):
    read = table(text)
    assert [(head.name, head.unit) for head in read.heads] == [("x", "mm"), ("y", "m")]
    np.testing.assert_array_equal(read.numbers, [[1.25, 2.0], [3.0, 0.004]])
    np.testing.assert_allclose(read.steps, [0.01, 0.001])


@pytest.mark.parametrize(
    ("cell", "step"), [("5", 1.0), ("-0.500", 1e-3), ("1.25e-3", 1e-5), ("2E+2", 1.0), ("nan", 1.0)]
)
def test_what_the_last_digit_stands_for(table, cell, step):
    read = table(f"{cell} 0\n1 0.12345678\n", may_be_endless=True)
    np.testing.assert_allclose(read.steps, [step, 1e-8])


def test_without_a_head_and_with_empty_cells(table):
    read = table("1,,3\n4,5,\n")
    assert read.heads is None
    assert read.lines.tolist() == [1, 2]
    np.testing.assert_array_equal(read.numbers, [[1, np.nan, 3], [4, 5, np.nan]])


def test_numbers_that_were_recorded_may_be_none(table):
    read = table("a\nnan\n-inf\n1\n", may_be_endless=True)
    np.testing.assert_array_equal(read.numbers[:, 0], [np.nan, -np.inf, 1.0])


@pytest.mark.parametrize(
    ("text", "line", "column", "reason"),
    [
        ("", 0, 0, "is empty"),
        ("# nothing\n", 0, 0, "is empty"),
        ("x,y\n", 0, 0, "has a head and no row"),
        ("x,y\n1,2\n\n1,a\n", 4, 2, "'a' is not a number"),
        ("x;y\n1,5;2\n", 2, 1, "write decimals with a point"),
        ("1,2\n1,nan\n", 2, 2, "nan is not a finite number"),
        ("1,2\n1e99,2\n", 2, 1, "1e\\+99 must be at most 1e\\+30"),
        ("1,2\n1,-1e400\n", 2, 2, "-inf is not a finite number"),
        ("x,y\n1,2\n1,25", 3, 0, "this last line has no end, so it may be cut off"),
        ("1,2\n1,2,3\n", 2, 0, "has 3 cells, and the first line has 2"),
        ("x,x\n1,2\n", 1, 2, "x stands twice"),
        ("x,[mm]\n1,2\n", 1, 2, "is no head"),
        (b"x\n\xff\n", 2, 1, "'ÿ' is not a number"),
    ],
)
def test_a_mistake_is_told_with_its_place(table, text, line, column, reason):
    with pytest.raises(TableError, match=reason) as told:
        table(text)
    assert (told.value.line, told.value.column) == (line, column)


def test_a_file_that_is_not_there_is_told(tmp_path):
    with pytest.raises(TableError, match="cannot be read: No such file"):
        read_table(tmp_path / "none.csv")
