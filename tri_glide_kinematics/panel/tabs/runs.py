"""The run that the panel drives: that of a program, or of a typed line."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from time import monotonic

from tri_glide_kinematics.errors import KinematicsError
from tri_glide_kinematics.panel.operator_requests import OperatorRequests
from tri_glide_kinematics.programs import ProgramRun, RunState

# Name and number of an output.
OutputKey = tuple[str, int]


class Runs:
    """One run at a time, whoever has begun it.

    Attributes:
        link: by which it runs.
        is_reserved: whether a line is proved that runs next; no more once all is to stop.
    """

    def __init__(self, requests: OperatorRequests) -> None:
        """Be ready to run; Stop ends the run, and ``resume`` lets one go on that waits."""
        self.link = requests.link.programs
        self.is_reserved = False
        self._requests = requests
        self._run: ProgramRun | None = None
        self._on_end: Callable[[], None] = lambda: None
        self._outputs: frozenset[OutputKey] = frozenset()
        requests.on_stop.append(self.stop)
        requests.link.on_resume = self._go_on

    @property
    def is_running(self) -> bool:
        """Whether something runs."""
        return self._run is not None and self._run.state is not RunState.ENDED

    @property
    def is_taken(self) -> bool:
        """Whether nothing else can begin now."""
        return self.is_reserved or self.is_running

    def drives(self, run: ProgramRun | None) -> bool:
        """Return whether it is this ``run`` that goes on."""
        return self.is_running and self._run is run

    def owns(self, output: OutputKey) -> bool:
        """Return whether a run goes on that alone changes an ``output``."""
        return self.is_running and output in self._outputs

    def begin(
        self, run: ProgramRun, on_end: Callable[[], None], outputs: Iterable[OutputKey] = ()
    ) -> None:
        """Begin a ``run``, which alone changes some ``outputs``; ``on_end`` is called behind it."""
        self._run, self._on_end, self._outputs = run, on_end, frozenset(outputs)

    def step(self) -> None:
        """Let the run go on."""
        if self._run is None or not self.is_running:
            return
        try:
            try:
                self._run.look(monotonic())
            finally:
                if not self.is_running:
                    self._on_end()
        except (KinematicsError, OSError) as error:
            # The rest of the page is shown all the same.
            self._requests.refuse(f"program: {error}")

    def stop(self) -> None:
        """End the run, if there is one, and let none follow: the machine was told to stop."""
        self.is_reserved = False
        if self._run is not None:
            self._run.stop()

    def may_end(self) -> bool:
        """End the run, if there is one, and return whether its platform rests, outputs off."""
        self.stop()
        return self._run is None or self._run.is_delivered(monotonic())

    def _go_on(self) -> bool:
        return self._run is not None and self._run.go_on()
