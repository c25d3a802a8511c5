"""The parts of which the meaning of a program is made, each alone."""

import pytest

from tri_glide_kinematics.programs.codes import CODES, carry_out
from tri_glide_kinematics.programs.dialects import Dialect
from tri_glide_kinematics.programs.machining import Feed, Machining, Offsets, Spindle, StepWriter
from tri_glide_kinematics.programs.program import Dwell, Output, PathRun
from tri_glide_kinematics.programs.settings import ProgramSettings
from tri_glide_kinematics.programs.words import Line, ProgramError, Remarks, WordReader


def machining(text="", dialect=Dialect.NIST):
    """Return what holds before the only line of a program."""
    reader = WordReader("a.ngc", text.encode(), frozenset(), frozenset(), False, False)
    machine = Machining(ProgramSettings(), dialect, Remarks(reader))
    machine.remarks.line = 1
    return machine


def line(*words):
    """Return a line of words with numbers that stands alone."""

    def fail(index, reason):
        raise ProgramError("", 1, 0, words[index] if index >= 0 else "", reason)

    return Line("".join(word[0] for word in words), [float(word[1:]) for word in words], fail)


def test_offsets_of_work_tool_and_place_add():
    offsets = Offsets({"G55": (1.0, 0.0, 0.0)})
    offsets.select("G55")
    offsets.set_tool((0.0, 0.5, 0.0))
    offsets.call({2: 0.25}, (0.0, 0.0, 1.0))
    assert offsets.shift == [1.0, 0.5, 0.75]
    offsets.call_no_more(for_good=False)
    assert offsets.shift == [1.0, 0.5, 0.0]
    offsets.call_again()
    assert offsets.shift == [1.0, 0.5, 0.75]
    offsets.call_no_more(for_good=True)
    offsets.call_again()
    assert offsets.shift == [1.0, 0.5, 0.0]


def test_a_writer_ends_a_path_where_it_rests():
    writer = StepWriter((0.0, 0.0, 0.0))
    assert writer.is_empty
    for number, place in enumerate(((1.0, 0.0, 0.0), (1.0, 1.0, 0.0)), 1):
        writer.put_out("digital", number, 1.0, number)
        writer.add(0, place, place, (0.0, 0.1), number, False)
    writer.rest(Dwell(1.0, 3))
    first, run, rest = writer.steps
    assert isinstance(run, PathRun) and run.lines.tolist() == [1, 2]
    assert (first, rest) == (Output("digital", 1, 1.0, 1, 0), Dwell(1.0, 3))
    assert run.outputs == (Output("digital", 2, 1.0, 2, 1),)
    assert writer.has_done(3) and not writer.has_done(2)


def test_what_turns_and_cools_goes_off():
    writer = StepWriter((0.0, 0.0, 0.0))
    spindle = Spindle(writer)
    spindle.set_speed(500.0)
    spindle.go_on_turning(1)
    spindle.turn(-1.0, 2)
    spindle.cool("mist", 1.0, 2)
    spindle.go_off(3)
    writer.finish()
    told = [(step.name, step.value, step.line) for step in writer.steps]
    assert told == [("spindle", -500.0, 2), ("mist", 1.0, 2), ("spindle", 0.0, 3), ("mist", 0.0, 3)]


def test_a_part_of_the_feed_is_driven():
    feed = Feed(0.0)
    feed.drive_part(0.5)
    assert feed.speed == 0.0
    feed.ask(0.2)
    assert feed.speed == 0.1


def test_a_line_gives_each_word_one_meaning():
    words = line("M3", "G1", "X2", "G90.1")
    assert words.commands == {"G1": 1, "G90.1": 3, "M3": 0}
    assert words.having("ZX") == ["X"] and words.take("X") == 2.0
    assert words.take("X") is None and words.having("ZX") == []
    words.finish()
    with pytest.raises(ProgramError, match="X2: X has no meaning on this line"):
        line("X2").finish()


@pytest.mark.parametrize(
    "words", [("G1", "X5", "G91", "F600", "G20"), ("F600", "G20", "G91", "G1", "X5")]
)
def test_a_line_is_carried_out_in_the_order_of_its_stages(words):
    machine = machining()
    machine.here[0] = 1.0
    carry_out(machine, line(*words))
    assert machine.here[0] == 1.0 + 5 * 0.0254
    assert machine.feed.speed == pytest.approx(10 * 0.0254)


def test_each_command_can_be_taken_alone():
    """Either it is carried out, or the line says what it needs."""
    for name in CODES:
        machine = machining(f"{name}\n", Dialect.REPRAP)
        words = line(name) if name[1:] else line(f"{name}1")
        try:
            carry_out(machine, words)
        except ProgramError as error:
            assert "not understood" not in str(error) or name == "G61"
