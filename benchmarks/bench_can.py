"""A cycle of three drives on CAN beside python-can alone: processor time, and jitter of SYNC.

Both send the same frames at 500 Hz over a pseudo-terminal (slcan), at whose other end a process
answers each SYNC, and keeps when it came. python-can alone throws away what comes back: to read it,
it would take another tenth of a core.
"""

from __future__ import annotations

import multiprocessing
import os
import time
import tty
from collections.abc import Iterator
from functools import partial
from multiprocessing.connection import Connection

import can
import numpy as np

from benchmarks.harness import Figure, figure, in_turn
from tri_glide_kinematics.drives import CanBus, Command, Frame, LineReader, cycle_frames, encoded

ROUNDS = 20
CYCLES = 500
PERIOD = 0.002  # s
BITRATE = 1_000_000  # bit/s
COMMANDS = [Command(node, 0x0F, 0x01020304) for node in (1, 2, 3)]
ANSWERS: list[Frame] = [(0x180 + node, bytes(6)) for node in (1, 2, 3)]
SYNC = 0x80


def figures() -> Iterator[Figure]:
    """Measure both in turn, a second each."""
    rounds = in_turn(ROUNDS, partial(_run, True), partial(_run, False))
    for number, (what, goal) in enumerate(
        (("CPU time of a cycle", 1.5), ("mean deviation of SYNC from its period", 1.2))
    ):
        ours, theirs = ([values[number] for values in side] for side in rounds)
        yield figure(f"three drives on CAN, {what}", "python-can, frames alone", ours, theirs, goal)


def _run(is_ours: bool) -> tuple[float, float]:
    """Return processor time of a cycle, and mean deviation of SYNC [s]."""
    far, near = os.openpty()
    tty.setraw(near)
    told, tells = multiprocessing.Pipe(duplex=False)
    other = multiprocessing.get_context("fork").Process(target=_answer, args=(far, tells))
    other.start()
    begin = _lead if is_ours else _send
    taken = begin(os.ttyname(near))
    stamps = told.recv()
    other.join()
    for file in (far, near):
        os.close(file)
    return taken, float(np.mean(np.abs(np.diff(stamps) - PERIOD)))


def _answer(far: int, tells: Connection) -> None:
    reader = LineReader()
    stamps: list[float] = []
    while len(stamps) < CYCLES:
        frames = reader.frames(os.read(far, 65536))
        now = time.monotonic()
        for cob_id, _ in frames:
            if cob_id == SYNC:
                stamps.append(now)
                os.write(far, encoded(ANSWERS))
    tells.send(stamps)


def _cycles() -> Iterator[None]:
    due = time.monotonic()
    for _ in range(CYCLES):
        due += PERIOD
        while (left := due - time.monotonic()) > 0.0:
            time.sleep(left)
        yield


def _lead(channel: str) -> float:
    bus = CanBus("slcan", channel, BITRATE, (1, 2, 3))
    begin = time.process_time()
    for _ in _cycles():
        bus.received()
        bus.send_cycle(COMMANDS)
    taken = time.process_time() - begin
    bus.close()
    return taken / CYCLES


def _send(channel: str) -> float:
    bus = can.Bus(channel, "slcan", bitrate=BITRATE, timeout=0, sleep_after_open=0)
    messages = [
        can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)
        for cob_id, data in cycle_frames(COMMANDS)
    ]
    begin = time.process_time()
    for _ in _cycles():
        os.read(bus.fileno(), 65536)
        for message in messages:
            bus.send(message)
    taken = time.process_time() - begin
    bus.shutdown()
    return taken / CYCLES
