"""cia402_node that plays setpoints out beside python-can alone: processor time, jitter of SYNC.

Both send the same frames at 500 Hz over a pseudo-terminal (slcan). Behind that of the node are
three simulated drives, behind the other one is something that answers each SYNC as they do; who
reads a SYNC keeps when it came. python-can alone does not read the answers, or reads them all.
"""

import itertools
import multiprocessing
import time
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection

import can
import numpy as np
from rclpy.action import ActionClient

from benchmarks.bench_cycle import Times, watch
from benchmarks.harness import Figure, figure
from benchmarks.ros_session import Session, session
from testing.goals import SentGoal
from tri_glide_interfaces.action import Home
from tri_glide_kinematics.drives import Command, Frame, SimulatedDrive, Terminals, cycle_frames

PERIOD = 0.002  # s
BITRATE = 1_000_000  # bit/s
COMMANDS = [Command(node, 0x0F, 0x01020304) for node in (1, 2, 3)]
ANSWERS: list[Frame] = [(0x180 + node, bytes(6)) for node in (1, 2, 3)]
SYNC = 0x80
PLACE = "/ours"
QUICK = {"homing_speed": 0.5, "homing_acceleration": 5.0, "heartbeat_timeout": 0.5}
DELAY = 0.06  # s

FORK = multiprocessing.get_context("fork")


class _Stamps:
    """Is on a bus, and keeps when each SYNC came; answers it, if it is alone."""

    def __init__(self, answers: Sequence[Frame]) -> None:
        self.stamps: list[float] = []
        self._answers, self._due = answers, list[Frame]()
        self._now = 0.0

    def advance(self, now: float) -> list[Frame]:
        """Note the time; return what is to be sent."""
        self._now = now
        due, self._due = self._due, []
        return due

    def receive(self, frame: Frame) -> None:
        """Take in a frame."""
        if frame[0] == SYNC:
            self.stamps.append(self._now)
            self._due.extend(self._answers)


def _far_end(tells: Connection, has_drives: bool) -> None:
    """Serve a terminal for ever; tell its path, and, when asked, all stamps."""
    terminals = Terminals()
    tells.send(terminals.paths[0])
    stamps = _Stamps(() if has_drives else ANSWERS)
    nodes = (1, 2, 3) if has_drives else ()
    drives = [SimulatedDrive(node, now=time.monotonic()) for node in nodes]

    def look() -> bool:
        if tells.poll():
            tells.recv()
            tells.send(stamps.stamps)
        return True

    terminals.serve([stamps, *drives], look)


def _send(channel: str, reads: bool) -> None:
    """Send the frames for ever, by python-can alone."""
    bus = can.Bus(channel, "slcan", bitrate=BITRATE, timeout=0, sleep_after_open=0)
    messages = [
        can.Message(arbitration_id=cob_id, data=data, is_extended_id=False)
        for cob_id, data in cycle_frames(COMMANDS)
    ]
    begin = time.monotonic()
    for cycle in itertools.count(1):
        while (left := begin + cycle * PERIOD - time.monotonic()) > 0.0:
            time.sleep(left)
        for message in messages:
            bus.send(message)
        while reads and bus.recv(0) is not None:
            pass


def figures() -> Iterator[Figure]:
    """Watch the node and each of the two at the same time, on a core each."""
    # Who leads drives has to read what they answer.
    for reads, goals in ((False, (None, 1.2)), (True, (1.5, None))):
        reference = f"python-can, frames alone, answers {'read' if reads else 'left alone'}"
        ours, theirs = _watched(reads)
        for what, goal, one, other in zip(
            ("CPU time per second", "mean deviation of SYNC from its period"), goals, ours, theirs
        ):
            yield figure(
                f"cia402_node at 500 Hz, setpoints played out: {what}", reference, one, other, goal
            )


def _watched(reads: bool) -> tuple[Times, ...]:
    """Return CPU times and mean deviations of each window, of the node and of the other one."""
    ends, paths, processes = [], [], []
    for has_drives in (True, False):
        ours, its = FORK.Pipe()
        processes.append(FORK.Process(target=_far_end, args=(its, has_drives), daemon=True))
        processes[-1].start()
        ends.append(ours)
        paths.append(ours.recv())
    try:
        with session() as running:
            other = FORK.Process(target=_send, args=(paths[1], reads), daemon=True)
            other.start()
            processes.append(other)
            return _compare(ends, (_led(running, paths[0]), int(other.pid or 0)))
    finally:
        for process in processes:
            process.kill()


def _led(running: Session, channel: str) -> int:
    """Start the nodes, home, and let setpoints come; return the process of ``cia402_node``."""
    pid = running.start_node("cia402_node", PLACE, channel=channel, playout_delay=DELAY, **QUICK)
    actions = ActionClient(running.node, Home, f"{PLACE}/cia402_node/home")
    running.spin_until(actions.server_is_ready, "~/home")
    end = time.monotonic() + 10.0
    while SentGoal(running, actions, Home.Goal()).result().code and time.monotonic() < end:
        time.sleep(0.5)
    running.start_node("ik_node", PLACE, drive_delay=DELAY)
    time.sleep(4.0)
    return pid


def _compare(ends: Sequence[Connection], pids: tuple[int, int]) -> tuple[Times, ...]:
    windows, loads = watch(pids)
    jitters: Times = ([], [])
    for of_side, end in zip(jitters, ends):
        end.send(None)
        stamps = np.array(end.recv())
        for first, last in np.searchsorted(stamps, 1e-9 * np.array(windows)):
            of_side.append(float(np.mean(np.abs(np.diff(stamps[first:last]) - PERIOD))))
    return tuple(zip(loads, jitters))
