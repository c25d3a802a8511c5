"""STUB for development; not committed."""
from __future__ import annotations
from dataclasses import dataclass
from tri_glide_kinematics.vectors import Vector3

@dataclass(frozen=True)
class Setpoint:
    time: float
    heights: Vector3
    velocities: Vector3

class Playout:
    def __init__(self, delay: float, period: float, brake: Vector3) -> None:
        self.delay, self.period, self.brake = delay, period, brake
        self.restart()
    def restart(self) -> None:
        self.store: list[Setpoint] = []
        self.at: float | None = None
        self.has_run_dry = False
        self.heights = None
        self.v = [0.0]*3
        self.rests = True
    def put(self, setpoint: Setpoint, now: float) -> None:
        if self.has_run_dry:
            return
        self.store.append(setpoint)
        if self.at is None:
            self.at = now + self.delay - setpoint.time
    def next(self, now: float):
        if self.at is None or now - self.at < self.store[0].time - 1e-9 and self.heights is None:
            return None
        t = now - self.at
        while len(self.store) > 1 and self.store[1].time <= t + 1e-9:
            self.store.pop(0)
        if not self.has_run_dry and len(self.store) > 1:
            a, b = self.store[0], self.store[1]
            f = (t - a.time) / (b.time - a.time)
            self.heights = [x + f * (y - x) for x, y in zip(a.heights, b.heights)]
            self.v = list(a.velocities)
            self.rests = not any(self.v)
        else:
            self.has_run_dry = True
            self.heights = [h + v * self.period for h, v in zip(self.heights or self.store[0].heights, self.v)]
            self.v = [max(0, abs(v) - b * self.period) * (1 if v > 0 else -1) for v, b in zip(self.v, self.brake)]
            self.rests = not any(self.v)
        return tuple(self.heights), tuple(self.v)
