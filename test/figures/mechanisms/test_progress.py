"""The progress bar: silent while the work is short, and right when it is not."""

import io

import pytest

from tri_glide_kinematics.figures.mechanisms.progress import ProgressBar


class Screen(io.StringIO):
    def __init__(self, terminal):
        super().__init__()
        self.terminal = terminal

    def isatty(self):
        return self.terminal


def work(screen, steps, seconds_each, fail_at=None):
    now = [0.0]
    with ProgressBar(steps, screen, clock=lambda: now[0]) as bar:
        for step in range(steps):
            bar.step(f"step {step}")
            if step == fail_at:
                raise RuntimeError
            now[0] += seconds_each


@pytest.mark.parametrize("terminal", [True, False])
def test_nothing_is_shown_for_less_than_a_second(terminal):
    screen = Screen(terminal)
    work(screen, 100, 0.0099)
    assert screen.getvalue() == ""


def test_a_terminal_keeps_one_line_that_ends_complete():
    screen = Screen(terminal=True)
    work(screen, 200, 0.125)
    text = screen.getvalue()
    assert text.count("\n") == 1 and text.endswith("\n")
    states = text.rstrip("\n").split("\r")[1:]
    percents = [int(state.split("]")[1].split("%")[0]) for state in states]
    assert percents == list(range(4, 101))
    assert states[0].startswith("[--") and "step 8" in states[0]
    assert "-" not in states[-1].split("]")[0] and "done" in states[-1]


def test_elsewhere_each_tenth_is_a_line():
    screen = Screen(terminal=False)
    work(screen, 200, 0.1)
    lines = screen.getvalue().splitlines()
    assert len(lines) == 11
    assert [line.split("]")[1][:4] for line in lines[1:3]] == ["  10", "  20"]
    assert "\r" not in screen.getvalue() and "\x1b" not in screen.getvalue()


def test_work_that_fails_is_not_shown_as_done():
    screen = Screen(terminal=True)
    with pytest.raises(RuntimeError):
        work(screen, 10, 0.5, fail_at=6)
    assert "100 %" not in screen.getvalue()
    assert screen.getvalue().endswith("\n")


def test_the_total_may_grow():
    screen = Screen(terminal=True)
    now = [5.0]
    with ProgressBar(1, screen, clock=lambda: now[0]) as bar:
        bar.step("first")
        bar.total += 3
        now[0] += 2.0
        for _ in range(3):
            bar.step("more")
    assert [text[-1] for text in screen.getvalue().split(" %")[:-1]] == ["5", "0", "5", "0"]
