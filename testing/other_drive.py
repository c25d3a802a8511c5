"""A servo drive after CiA 301 and CiA 402 in virtual time.

A second opinion on both standards: it shares no code with the package, and is as strict as they
allow. Its objects stand in ``other_drive.txt``. Where targets come with SYNC, the axis moves in the
time of SYNC (`Node.move`). Inside, positions are counts along the axis. It tells of each event, in
SI units.
"""

import dataclasses
import random
import struct
from collections import deque
from collections.abc import Callable, Generator
from pathlib import Path

TICK = 0.001
BRAKE = 50.0  # m/s^2, of an axis without power
FORMATS = {"u8": "<B", "u16": "<H", "u32": "<I", "i8": "<b", "i16": "<h", "i32": "<i"}
OBJECTS = Path(__file__).with_suffix(".txt").read_text().splitlines()
INVALID, NO_REMOTE_REQUEST = 1 << 31, 1 << 30
# NMT states, as heartbeats tell them.
BOOTING, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0, 4, 5, 127
# States of CiA 402: bits 0 to 3, 5 and 6 of the status word.
STATES = 0x00, 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08
NOT_READY, DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, REACTION, FAULT = STATES
WORDS = "not ready,disabled,ready,switched on,enabled,quick stop,fault reaction,fault"
NAMES = dict(zip(STATES, WORDS.split(",")))
POWERED = (ENABLED, QUICK_STOP, REACTION)
COMMANDS = (  # mask and value of the control word, and where they lead
    (0x82, 0x00, dict.fromkeys((READY, SWITCHED_ON, ENABLED, QUICK_STOP), DISABLED)),
    (0x86, 0x02, {READY: DISABLED, SWITCHED_ON: DISABLED, ENABLED: QUICK_STOP}),
    (0x87, 0x06, dict.fromkeys((DISABLED, SWITCHED_ON, ENABLED), READY)),
    (0x8F, 0x07, {READY: SWITCHED_ON, ENABLED: SWITCHED_ON}),
    (0x8F, 0x0F, {READY: SWITCHED_ON, SWITCHED_ON: ENABLED, QUICK_STOP: ENABLED}),
)
# Power stage and brake take their time: seconds in the state before, by the state after.
DELAYS = {SWITCHED_ON: 0.05, ENABLED: 0.1}


class AbortError(Exception):
    """An access to the object dictionary that is refused; its argument is the abort code."""


def expect(condition: object, code: int) -> None:
    """Refuse an access with that abort code unless a condition holds."""
    if not condition:
        raise AbortError(code)


@dataclasses.dataclass
class Entry:
    """One object: its kind, access, value, the PDOs that may hold it, what may be written."""

    kind: str
    access: str
    value: int
    pdo: str
    values: str

    @property
    def size(self) -> int:
        """Bytes."""
        return struct.calcsize(FORMATS[self.kind])


class Dictionary:
    """The object dictionary of one drive: ``od[0x6040]``, ``od[0x60C2, 1]``."""

    def __init__(self, node: int, scale: float) -> None:
        """Fill it with defaults; ``scale`` is in counts per metre."""
        self.node, self.scale = node, scale
        self.entries: dict[tuple[int, int], Entry] = {}
        for row in OBJECTS:
            if row.startswith("#"):
                continue
            place, kind, access, text, pdo, values = row.split()
            if text.startswith("@"):
                value = round(float(text[1:]) * self.scale)
            else:
                value = int(text.removesuffix("+n"), 0) + self.node * text.endswith("+n")
            key = int(place[:4], 16), int(place[5:])
            self.entries[key] = Entry(kind, access, value, pdo, values)

    def entry(self, index: int, sub: int) -> Entry:
        """Return an entry, or raise an AbortError when there is none."""
        expect((index, 0) in self.entries, 0x06020000)
        expect((index, sub) in self.entries, 0x06090011)
        return self.entries[index, sub]

    def __getitem__(self, key: int | tuple[int, int]) -> int:
        """Return a value."""
        return self.entries[(key, 0) if isinstance(key, int) else key].value

    def __setitem__(self, key: int | tuple[int, int], value: float) -> None:
        """Set a value from inside, whatever its access."""
        self.entries[(key, 0) if isinstance(key, int) else key].value = round(value)

    def packed(self, index: int, sub: int) -> bytes:
        """Return the bytes of a value."""
        entry = self.entry(index, sub)
        expect(index != 0x1003 or sub <= self[0x1003], 0x08000024)
        return struct.pack(FORMATS[entry.kind], entry.value)

    def unpacked(self, index: int, sub: int, data: bytes) -> int:
        """Return the value of ``data`` for an entry, or raise an AbortError when it is wrong."""
        entry = self.entry(index, sub)
        expect(entry.access == "rw", 0x06010002)
        expect(len(data) == entry.size, 0x06070010)
        value = int(struct.unpack(FORMATS[entry.kind], data)[0])
        ranges = [part.split("..") for part in entry.values.split(",") if part != "-"]
        fits = (int(part[0], 0) <= value <= int(part[-1], 0) for part in ranges)
        expect(not ranges or any(fits), 0x06090030)
        return value


@dataclasses.dataclass
class Axis:
    """A carriage between hard stops, with a limit switch before each; counts and seconds."""

    place: float
    stops: tuple[float, float]
    switches: tuple[float, float]
    most: float  # acceleration
    speed: float = 0.0

    def step(self, wanted: float, most: float) -> None:
        """Move for one tick towards a speed, with at most that acceleration."""
        self.speed += min(max(wanted - self.speed, -most * TICK), most * TICK)
        free = self.place + self.speed * TICK
        self.place = min(max(free, self.stops[0]), self.stops[1])
        self.speed *= self.place == free

    def pressed(self) -> int:
        """Return the switches that are pressed, as in 0x60FD: bit 0 the lower, 1 the upper one."""
        return (self.place <= self.switches[0]) + 2 * (self.place >= self.switches[1])


class Drive:
    """One drive after CiA 402: states, modes, position control. It knows no bus."""

    def __init__(
        self, od: Dictionary, axis: Axis, home_sign: int, tell: Callable[..., None]
    ) -> None:
        """``tell(event, **numbers)`` reports; ``home_sign`` times 0x607C is what home reads."""
        self.od, self.axis, self.home_sign, self.tell = od, axis, home_sign, tell
        self.emergency: Callable[[int], None] = lambda code: None
        draw = random.Random(f"bits of node {od.node}")
        # Bits that the standard leaves to the manufacturer, and those that it calls "don't care".
        self.own_bits = draw.choice((0x4000, 0x8000, 0x8100, 0xC100))
        self.free_bits = draw.choice((0x00, 0x20))
        self.feeds_forward = False  # 0x60B1 comes by a PDO
        self.now = 0.0
        self.switch_on()

    def switch_on(self) -> None:
        """Begin with nothing known: the encoder counts from here."""
        self.state, self.entered, self.word, self.mode = NOT_READY, self.now, 0, 0
        self.zero, self.homed, self.homing_bits = self.axis.place, False, 0x400
        self.homing: Generator[float, None, None] | None = None
        # The state that a stop leads to when the axis rests (or None), and its deceleration.
        self.stop: tuple[int | None, float] | None = None
        self.demand, self.demanded_speed, self.limited = self.axis.place, 0.0, False
        # The piece between two targets: counts of 0x607A, and when it began.
        self.start, self.goal, self.began = 0.0, 0.0, self.now
        self.mode_since = self.lag_since = self.now
        self.targets: deque[int] = deque(maxlen=3)
        self.speeds: deque[float] = deque([0.0] * 2, maxlen=2)

    @property
    def period(self) -> float:
        """Interpolation time period (0x60C2), s."""
        return float(self.od[0x60C2, 1] * 10.0 ** self.od[0x60C2, 2])

    def enter(self, state: int) -> None:
        """Take a state."""
        self.state, self.entered, self.stop = state, self.now, None
        speed, height = self.axis.speed / self.od.scale, self.axis.place / self.od.scale
        self.tell("state", state=NAMES[state], height=height, speed=speed)

    def brake(self, option: int, goal: int | None) -> None:
        """Stop as an option code asks (0: at once without power, 1: slowly, 2: fast)."""
        if option == 0 and goal is not None:
            self.enter(goal)
        else:
            self.stop = goal, self.od[0x6085 if option == 2 else 0x6084]

    def fault(self, code: int) -> None:
        """Go to Fault, by the reaction of 0x605E where power is on."""
        if self.state in (FAULT, REACTION):
            return
        self.od[0x603F] = code
        self.tell("fault", code=f"0x{code:04X}", state=NAMES[self.state])
        self.emergency(code)
        powered = self.state in POWERED
        self.enter(REACTION)
        self.brake(self.od[0x605E] * powered, FAULT)

    def connection_lost(self, code: int) -> None:
        """Do what 0x6007 asks for when the master is gone; ``code`` is the error."""
        option = self.od[0x6007]
        if option == 1:
            self.fault(code)
        elif option:
            self.od[0x6040] = 0x00 if option == 2 else 0x02
            self.command()

    def command(self) -> None:
        """Obey the control word. Its commands are levels; only fault reset and homing are edges."""
        od, word = self.od, self.od[0x6040]
        edges, self.word = word & ~self.word, word
        if self.state == NOT_READY and self.now - self.entered > 0.05:
            self.enter(DISABLED)
        elif self.state == FAULT and edges & 0x80:
            od[0x603F] = 0
            self.emergency(0)
            self.enter(DISABLED)
        led = (steps.get(self.state) for mask, value, steps in COMMANDS if word & mask == value)
        goal, option = next(led, None), od[0x605A]
        if goal is None or self.now - self.entered < DELAYS.get(goal, 0.0):
            pass
        elif goal == QUICK_STOP:
            self.enter(goal)
            self.brake(option if option < 5 else option - 4, DISABLED if option < 5 else None)
        elif goal == ENABLED and (self.state == SWITCHED_ON or option >= 5):
            self.enter(goal)
            self.engage()
        elif self.state == ENABLED and goal != DISABLED:
            self.brake(od[0x605B if goal == READY else 0x605C], goal)
        elif goal != ENABLED:
            self.enter(goal)
        if self.state == ENABLED and self.mode == 6 and edges & 0x10 and not self.stop:
            self.homing, self.homing_bits = self.home(), 0
        if self.homing and (not word & 0x10 or self.state not in POWERED):
            self.homing, self.homing_bits = None, 0x400  # interrupted

    def engage(self) -> None:
        """Begin to follow targets from where the axis is; refuse one that is far away."""
        od = self.od
        self.demand, self.demanded_speed = self.axis.place, 0.0
        self.began = self.lag_since = self.now
        self.start = self.goal = self.demand - self.zero
        self.targets.clear()
        if self.mode == 8:
            self.targets.append(od[0x607A])
            if od[0x1006] and abs(od[0x1006] * 1e-6 - self.period) > 1e-7:
                self.fault(0x6320)  # the cycle of the bus is not the period of interpolation
            elif abs(od[0x607A] - self.goal) > od[0x6065]:
                self.fault(0x8611)

    def take_target(self) -> None:
        """Begin the piece to the target 0x607A: at a SYNC, or when one comes without."""
        od, target = self.od, self.od[0x607A]
        if self.mode != 8 or self.state != ENABLED or self.stop:
            return
        waited = max(self.period, min(self.now - self.began, 0.1))
        if abs(target - self.targets[-1]) > 1.2 * od[0x607F] * waited:
            self.fault(0x8611)
            return
        self.targets.append(target)
        self.start, self.began = self.demand - self.zero, self.now
        # CiA 402 tells software limits from home, not from zero.
        home = od[0x607C] if self.home_sign < 0 else 0
        low, high = od[0x607D, 1] - home, od[0x607D, 2] - home
        self.goal = min(max(target, low), high) if self.homed and low < high else target

    def home(self) -> Generator[float, None, None]:
        """Yield the speed that homing asks for; end where home is found."""
        od, axis, method = self.od, self.axis, self.od[0x6098]
        self.tell("homing", method=method)
        edge, fast, slow = axis.place, od[0x6099, 1], od[0x6099, 2]
        if method < 35:
            switch, way = (1, -1) if method == 17 else (2, 1)
            if not fast or not slow:
                self.homing_bits = 0x2400
                return
            while not axis.pressed() & switch:
                yield way * fast
            while self.demanded_speed:
                yield 0.0
            while axis.pressed() & switch:
                yield -way * slow
            edge = axis.place
            while self.demanded_speed:
                yield 0.0
        self.zero = edge - self.home_sign * od[0x607C]
        self.homing_bits, self.homed = 0x1400, True
        self.tell("homed", home=edge / od.scale, height=axis.place / od.scale)

    def ramp(self, speed: float, acceleration: float) -> None:
        """Lead the demand to a speed."""
        step = acceleration * TICK
        self.demanded_speed += min(max(speed - self.demanded_speed, -step), step)
        self.demand += self.demanded_speed * TICK

    def interpolate(self) -> None:
        """Lead the demand to the target, and no farther into a limit switch."""
        slope, age = (self.goal - self.start) / self.period, self.now - self.began
        if age > self.period + TICK / 2:  # nothing new has come
            self.start, slope = self.goal, 0.0
        wanted = self.zero + self.start + slope * age
        low, high = self.axis.switches
        self.demand = min(max(wanted, min(low, self.demand)), max(high, self.demand))
        self.demanded_speed = slope if wanted == self.demand else 0.0
        self.limited = wanted != self.demand or self.goal != self.targets[-1]

    def tick(self) -> None:
        """Work for a millisecond."""
        od, axis = self.od, self.axis
        self.command()
        if od[0x6060] == self.mode or od[0x6060] not in (6, 8):
            self.mode_since = self.now
        elif self.now - self.mode_since > 0.02 and not self.demanded_speed:
            self.mode, self.homing, self.homing_bits = od[0x6060], None, 0x400
            if self.state == ENABLED:
                self.engage()
        if self.state in POWERED:
            self.follow()
        else:
            axis.step(0.0, BRAKE * od.scale)
            self.demand, self.demanded_speed, self.limited = axis.place, 0.0, False
        self.speeds.append(axis.speed)
        od[0x6041], od[0x6061] = self.status(), self.mode
        od[0x6062], od[0x6064] = self.demand - self.zero, axis.place - self.zero
        od[0x606C], od[0x60F4] = axis.speed, self.demand - axis.place
        force = (self.speeds[-1] - self.speeds[-2]) / TICK / axis.most * 1000
        od[0x6077] = min(max(force, -1000.0), 1000.0)
        od[0x60FD] = axis.pressed()

    def follow(self) -> None:
        """Find the demand of this tick, let the axis follow it, and judge the lag."""
        od, axis = self.od, self.axis
        if self.stop:
            self.ramp(0.0, self.stop[1])
            rests = not self.demanded_speed and abs(axis.speed) < 0.001 * od.scale
            if rests and self.stop[0] is not None:
                self.enter(self.stop[0])
        elif self.mode == 8 and self.state == ENABLED:
            self.interpolate()
        else:
            speed = next(self.homing, None) if self.homing else 0.0
            if speed is None:
                self.homing = None
            self.ramp(speed or 0.0, od[0x609A] if self.homing else od[0x6084])
        cyclic = self.mode == 8 and not self.stop and self.feeds_forward
        wanted = od[0x60B1] if cyclic else self.demanded_speed
        wanted += 100 * (self.demand - axis.place)
        axis.step(axis.speed + (wanted - axis.speed) / 2, axis.most * od[0x6072] / 1000)
        if abs(self.demand - axis.place) <= od[0x6065] or od[0x6065] == 0xFFFFFFFF:
            self.lag_since = self.now
        elif self.now - self.lag_since > od[0x6066] * 0.001:
            self.fault(0x8611)

    def status(self) -> int:
        """Return the status word."""
        bits = self.state | 0x0210 | self.own_bits
        if self.state in (DISABLED, FAULT, REACTION):
            bits |= self.free_bits
        if self.mode == 6:
            bits |= self.homing_bits & (0xFFFF if not self.demanded_speed else 0xFBFF)
        elif self.mode == 8 and self.state == ENABLED:
            bits |= 0x1000 * (not self.stop) | 0x0800 * self.limited
            bits |= 0x2000 * (abs(self.demand - self.axis.place) > self.od[0x6065])
        return bits


class Node:
    """The CANopen side of a drive: NMT, SDO, PDO, SYNC, EMCY and heartbeats."""

    def __init__(self, drive: Drive, send: Callable[[int, bytes], None]) -> None:
        """``send(identifier, data)`` puts a frame on the bus."""
        self.drive, self.od, self.transmit, self.tell = drive, drive.od, send, drive.tell
        self.number, self.now = drive.od.node, drive.now
        drive.emergency = self.emergency
        # It is silent at first, then it sends the boot-up message.
        self.nmt, self.silent_until = BOOTING, self.now + 0.1
        self.seen: dict[int, float] = {}  # when a heartbeat of that node came
        self.lost: set[int] = set()
        self.kept: dict[int, bytes] = {}  # frames of synchronous RPDOs that wait for SYNC
        self.sent: dict[int, tuple[float, bytes]] = {}
        self.syncs = self.received = 0
        self.synced = self.beaten = self.now
        self.due, self.waits = 0, False  # ticks to the next SYNC; the axis waits for it

    def emergency(self, code: int) -> None:
        """Send an EMCY message, and keep the error in the history."""
        od = self.od
        bit = 0x10 if code >> 8 in (0x81, 0x82) else {2: 2, 3: 4, 4: 8}.get(code >> 12, 0x20)
        od[0x1001] = od[0x1001] | 1 | bit if code else 0
        if code:
            for sub in range(8, 1, -1):
                od[0x1003, sub] = od[0x1003, sub - 1]
            od[0x1003, 1], od[0x1003] = code, min(od[0x1003] + 1, 8)
        if self.nmt in (OPERATIONAL, PRE_OPERATIONAL) and not od[0x1014] & INVALID:
            self.transmit(od[0x1014], struct.pack("<HB5s", code, od[0x1001], b"other"))

    def set_nmt(self, state: int) -> None:
        """Take an NMT state."""
        if state == self.nmt:
            return
        self.nmt, self.synced, self.syncs, self.received = state, self.now, 0, 0
        self.kept.clear()
        self.sent.clear()
        self.tell("nmt", nmt=state)
        mapped = [part >> 16 for k in range(4) for part in self.mapping(0x1600 + k)]
        self.drive.feeds_forward = 0x60B1 in mapped
        if state == STOPPED and self.drive.state in POWERED:
            self.drive.connection_lost(0x8100)

    def mapping(self, index: int) -> list[int]:
        """Return what a PDO that is valid holds, as entries of its mapping."""
        valid = not self.od[index - 0x200, 1] & INVALID
        return [self.od[index, sub + 1] for sub in range(self.od[index] * valid)]

    def receive(self, identifier: int, data: bytes) -> None:
        """Take a frame of the master."""
        if self.nmt == BOOTING:
            return
        if identifier == 0 and len(data) == 2 and data[1] in (0, self.number):
            states = {1: OPERATIONAL, 2: STOPPED, 0x80: PRE_OPERATIONAL}
            self.set_nmt(states.get(data[0], self.nmt))
        elif 0x700 < identifier < 0x780:
            self.seen[identifier - 0x700] = self.now
            if identifier - 0x700 in self.lost:
                self.lost.remove(identifier - 0x700)
                if self.drive.state not in (FAULT, REACTION):
                    self.emergency(0)
        elif self.nmt == STOPPED:
            return
        elif self.nmt == OPERATIONAL and identifier == self.od[0x1005] & 0x7FF:
            if data:
                self.emergency(0x8240)
            else:
                self.sync()
        elif self.nmt == OPERATIONAL:
            for k in range(4):
                if identifier == self.od[0x1400 + k, 1]:
                    if self.od[0x1400 + k, 2] > 240:
                        self.apply(k, data)
                    else:
                        self.kept[k] = data
                        self.received += 0x607A0020 in self.mapping(0x1600 + k)

    def apply(self, k: int, data: bytes) -> None:
        """Take the values of an RPDO."""
        parts = self.mapping(0x1600 + k)
        length = sum(part & 0xFF for part in parts) // 8
        if len(data) != length:
            self.tell("length", rpdo=k + 1, bytes=len(data), mapped=length)
            self.emergency(0x8210 if len(data) < length else 0x8220)
            if len(data) < length:
                return
        for part in parts:
            index, sub, size = part >> 16, part >> 8 & 0xFF, (part & 0xFF) // 8
            try:
                self.od[index, sub] = self.od.unpacked(index, sub, data[:size])
            except AbortError as error:
                self.tell("abort", code=f"0x{error.args[0]:08X}", rpdo=k + 1, index=f"{index:04X}")
            data = data[size:]
        self.drive.command()
        if self.od[0x1400 + k, 2] > 240 and 0x607A0020 in parts:
            self.drive.take_target()

    def sync(self) -> None:
        """Sample what is sent, then let take effect what was received."""
        while self.due and self.drive.now < self.now + 0.05:
            self.move()
        self.syncs += 1
        self.synced = self.now
        for k in range(4):
            kind = self.od[0x1800 + k, 2]
            if kind == 0 or (kind <= 240 and self.syncs % kind == 0):
                self.send_pdo(k, only_changed=kind == 0)
        kept, self.kept = self.kept, {}
        for k, data in sorted(kept.items()):
            self.apply(k, data)
        synchronous = [k for k in range(4) if self.od[0x1400 + k, 2] <= 240]
        if any(0x607A0020 in self.mapping(0x1600 + k) for k in synchronous):
            self.drive.take_target()
            self.waits = self.drive.state == ENABLED and self.drive.mode == 8
            if self.waits and self.received != 1:
                self.tell("targets", count=self.received, sync=self.syncs)
            self.due = max(round(self.drive.period / TICK), 1) * self.waits
        self.received = 0

    def move(self) -> None:
        """Let the drive work for a tick.

        Where targets come with SYNC its time is that of SYNC, as in a real drive: it waits for one
        that is late, up to 0.1 s, and catches up. So the computer's jitter is not in the motion.
        """
        self.due = max(self.due - 1, 0)
        self.drive.now += TICK
        self.drive.tick()

    def send_pdo(self, k: int, only_changed: bool) -> None:
        """Send a TPDO, if it is valid."""
        parts = self.mapping(0x1A00 + k)
        data = b"".join(self.od.packed(part >> 16, part >> 8 & 0xFF) for part in parts)
        same = k in self.sent and self.sent[k][1] == data
        if data and not (only_changed and same):
            self.sent[k] = self.now, data
            self.transmit(self.od[0x1800 + k, 1] & 0x7FF, data)

    def tick(self) -> None:
        """Do what time asks for."""
        od = self.od
        if self.due or not self.waits or self.now - self.synced > 0.1:
            self.move()
        if self.nmt == BOOTING:
            if self.now >= self.silent_until:
                self.transmit(0x700 + self.number, b"\0")
                self.set_nmt(PRE_OPERATIONAL)
            return
        if od[0x1017] and self.now - self.beaten >= od[0x1017] * 0.001:
            self.beaten = self.now
            self.transmit(0x700 + self.number, bytes([self.nmt]))
        for sub in (1, 2):
            node, bound = od[0x1016, sub] >> 16, (od[0x1016, sub] & 0xFFFF) * 0.001
            late = bound and self.now - self.seen.get(node, self.now) > bound
            if late and node not in self.lost:
                self.lost.add(node)
                self.communication_error(0x8130)
        if self.nmt != OPERATIONAL:
            return
        if self.syncs and self.now - self.synced > (od[0x1006] * od[0x2000] or 1e9) * 1e-6:
            self.syncs = 0  # counted anew from the next one
            self.communication_error(0x8700)
        for k in range(4):
            if od[0x1800 + k, 2] >= 254:
                age = self.now - self.sent.get(k, (0.0, b""))[0]
                if age >= od[0x1800 + k, 3] * 1e-4:
                    timed = od[0x1800 + k, 5] and age >= od[0x1800 + k, 5] * 0.001
                    self.send_pdo(k, only_changed=not timed)

    def communication_error(self, code: int) -> None:
        """Do what 0x6007 and 0x1029 ask for."""
        self.tell("communication error", code=f"0x{code:04X}")
        if self.od[0x6007] != 1 or self.drive.state in (FAULT, REACTION):
            self.emergency(code)
        self.drive.connection_lost(code)
        if self.nmt == OPERATIONAL and self.od[0x1029, 1] != 1:
            self.set_nmt(STOPPED if self.od[0x1029, 1] else PRE_OPERATIONAL)

    def serve(self, data: bytes) -> bytes:
        """Return the answer to a request of an SDO client, or raise an AbortError."""
        command, index, sub = struct.unpack("<BHB", data[:4])
        if command >> 5 == 2:
            value = self.od.packed(index, sub)
            return struct.pack("<BHB4s", 0x43 | 4 - len(value) << 2, index, sub, value)
        # Segmented and block transfers are not served.
        expect(command >> 5 == 1 and command & 2, 0x05040001)
        size = 4 - (command >> 2 & 3) if command & 1 else self.od.entry(index, sub).size
        number = self.od.unpacked(index, sub, data[4 : 4 + size])
        self.guard(index, sub, number)
        self.od[index, sub] = number
        if index == 0x6040:
            self.drive.command()
        elif index == 0x607A:
            self.drive.take_target()
        return struct.pack("<BHB4x", 0x60, index, sub)

    def guard(self, index: int, sub: int, value: int) -> None:
        """Refuse with an AbortError what may not be written now, or not beside other objects."""
        od, old = self.od, self.od[index, sub]
        if index == 0x1016 and value & 0xFFFF:
            other = od[0x1016, 3 - sub]
            expect(not other & 0xFFFF or other >> 16 != value >> 16, 0x06040043)
        expect(index != 0x60C2 or self.drive.state not in POWERED, 0x08000022)
        expect(index != 0x6060 or not self.drive.demanded_speed, 0x08000022)
        kind = index & 0xFFFC
        if index == 0x1014 or (kind in (0x1400, 0x1800) and sub == 1):
            expect(old & INVALID or not (old ^ value) & 0x3FFFFFFF, 0x08000022)
            expect(0x80 < value & 0x3FFFFFFF < 0x6E0, 0x06090030)
            expect(value & 0x780 not in (0x100, 0x580, 0x600) or not value & 0x7F, 0x06090030)
            expect(kind != 0x1800 or value & NO_REMOTE_REQUEST, 0x06090030)
        expect(kind != 0x1800 or sub != 3 or od[index, 1] & INVALID, 0x08000022)
        if kind in (0x1600, 0x1A00):
            invalid, way = od[index - 0x200, 1] & INVALID, "r" if kind == 0x1600 else "t"
            expect(invalid and self.nmt == PRE_OPERATIONAL, 0x08000022)
            if sub:
                expect(not od[index], 0x08000022)
                mapped = od.entry(value >> 16, value >> 8 & 0xFF)
                expect(way in mapped.pdo and value & 0xFF == 8 * mapped.size, 0x06040041)
            else:
                bits = [od[index, k] & 0xFF for k in range(1, min(value, 8) + 1)]
                expect(value <= 8 and 0 not in bits and sum(bits) <= 64, 0x06040042)
