from tri_glide_kinematics.reason_log import ReasonLog


def test_few_reasons_are_all_written():
    lines: list[str] = []
    log = ReasonLog(lines.append, lines_per_second=3)
    for reason in "abc":
        log.add(reason)
    assert log.end_of_second() == 3
    assert lines == ["a", "b", "c"]
    assert (log.total, log.last) == (3, "c")


def test_a_flood_becomes_one_line_and_is_counted():
    lines: list[str] = []
    log = ReasonLog(lines.append, lines_per_second=2)
    for number in range(10_000):
        log.add(f"reason {number}")
    assert lines == ["reason 0", "reason 1"]
    assert log.end_of_second() == 10_000
    assert lines[2:] == ["9998 more in the last second; the latest: reason 9999"]
    assert log.end_of_second() == 0
    log.add("afterwards")
    assert lines[3:] == ["afterwards"]
    assert log.total == 10_001


def test_a_repeated_reason_is_written_once_a_second():
    lines: list[str] = []
    log = ReasonLog(lines.append, lines_per_second=10)
    for reason in "aaabaa":
        log.add(reason)
    assert lines == ["a", "b", "a"]
    assert log.end_of_second() == 6
    log.add("a")
    assert lines[3:] == ["3 more in the last second; the latest: a", "a"]
