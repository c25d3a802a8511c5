"""How answers of a service follow each other; times are given, none is waited for."""

from itertools import pairwise

from tri_glide_kinematics.ros.serving import patient_services
from tri_glide_kinematics.ros.serving.patient_services import (
    AT_ONCE,
    QUIET,
    SPACING,
    SPACING_IN_BURST,
    SPACING_PER_CLIENT,
)

# What a client keeps by default.
KEPT = 10


STEP = 0.002


def sent_at(asked, duration, clients=1, step=STEP, called=0.0):
    """Return when answers to calls at the times ``asked`` are sent; looked at each ``step``."""
    pace = patient_services._Pace(called=called)
    waiting = [patient_services._Answer(lambda: True, time, time) for time in asked]
    times = []
    for now in (step * k for k in range(round(duration / step))):
        while waiting and waiting[0].asked <= now:
            if not pace.is_turn(waiting[0], now, lambda: clients):
                break
            pace.note(now)
            times.append(now)
            waiting.pop(0)
    return times


def most_within(times, duration):
    """Return how many of ``times`` are within a ``duration`` at most."""
    return max(sum(begin <= time < begin + duration for time in times) for begin in times)


def test_half_of_what_a_client_keeps_is_sent_at_once_and_the_others_in_turns():
    times = sent_at([0.0] * 40, 1.0, called=-1.0)
    assert len(times) == 40
    assert sum(time == 0.0 for time in times) == AT_ONCE
    # So long may a client be kept from looking.
    assert most_within(times, (KEPT - AT_ONCE) * SPACING) <= KEPT


def test_while_calls_come_in_less_is_sent():
    times = sent_at([0.0] * 40, SPACING_IN_BURST, called=SPACING_IN_BURST - QUIET)
    assert len(times) == AT_ONCE


def test_more_clients_get_more_time():
    clients = 60
    times = sent_at([0.0] * 20, 2.0, clients, called=-1.0)
    later = times[AT_ONCE - 1 :]
    gaps = [after - before for before, after in pairwise(later)]
    assert len(times) == 20
    assert min(gaps) >= clients * SPACING_PER_CLIENT - 2.0 * STEP


def test_who_waits_for_each_answer_is_answered_at_once():
    asked = [0.002 * k for k in range(500)]
    assert sent_at(asked, 1.1) == asked


def test_turns_that_were_missed_are_made_up_for():
    assert len(sent_at([0.0] * 40, 0.42, step=0.02, called=-1.0)) == 40
