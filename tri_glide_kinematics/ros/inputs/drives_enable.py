"""The enable service of the drives: asked first when the machine is enabled, and last afterwards.

It is never waited for in the cycle: who waits is a coroutine, which the executor goes on with in
its turns (a sleep of no time is all that it knows of asyncio).
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from std_srvs.srv import SetBool

from tri_glide_kinematics.control import CommandRefusedError
from tri_glide_kinematics.errors import KinematicsError, Refusal

# The drives answer within 5 s, or say why they do not do it [s].
ANSWER_TIME = 6.0
# Once they have torque, heights are measured within this time [s].
HEIGHTS_TIME = 2.0


class DrivesRefusedError(KinematicsError):
    """The drives do not do what they are asked for."""


class DrivesEnable:
    """Gives the drives torque and takes it away, by their service.

    Attributes:
        group: of callbacks that may wait for an answer while others run.
    """

    def __init__(self, node: Node, name: str, tell: Callable[[str], object]) -> None:
        """Ask the service with this ``name``; ``tell`` gets why torque was not taken away."""
        self.group = ReentrantCallbackGroup()
        self._name = name
        self._tell = tell
        self._client = node.create_client(SetBool, name, callback_group=self.group)
        self._is_enabling = self._is_given_up = self._has_torque = False
        self._letting_go: tuple[Any, float] | None = None

    async def enable(self, lead: Callable[[], str]) -> str:
        """Give torque, and ``lead`` the machine once heights are measured; return that in words.

        Raises:
            KinematicsError: with the reason, if the machine is not led; then it has no torque.
        """
        if self._is_enabling:
            raise CommandRefusedError("the drives are being enabled already", Refusal.WAITING)
        self._is_enabling, self._is_given_up = True, False
        try:
            told = await self._asked_for_torque()
            end = time.monotonic() + HEIGHTS_TIME
            while not self._is_given_up:
                try:
                    return f"{lead()}; drives: {told}"
                except CommandRefusedError as error:
                    if error.refusal is not Refusal.NO_MEASUREMENT or time.monotonic() > end:
                        raise
                await asyncio.sleep(0)
            raise DrivesRefusedError("disabled before it was enabled")
        except Exception:
            self.let_go()
            raise
        finally:
            self._is_enabling = False

    async def _asked_for_torque(self) -> str:
        """Return what the drives say once they have torque.

        Raises:
            DrivesRefusedError: if they do not get it in time.
        """
        if not self._client.service_is_ready():
            raise DrivesRefusedError(f"there is no service {self._name} of the drives")
        self._has_torque, self._letting_go = True, None
        future = self._client.call_async(SetBool.Request(data=True))
        end = time.monotonic() + ANSWER_TIME
        while not future.done():
            if time.monotonic() > end:
                future.cancel()
                raise DrivesRefusedError(f"{self._name} has not answered in {ANSWER_TIME:g} s")
            await asyncio.sleep(0)
        answer = future.result()
        if not answer.success:
            raise DrivesRefusedError(f"the drives are not enabled: {answer.message}")
        return str(answer.message)

    def give_up(self) -> None:
        """Let an enabling that goes on lead to nothing; torque is taken away, whoever gave it."""
        self._is_given_up = self._has_torque = True

    def look(self, leads: bool) -> None:
        """Take torque away once the machine is not led any more; to be called in each cycle."""
        if self._letting_go is not None:
            future, end = self._letting_go
            answer = future.result() if future.done() else None
            if answer is not None or time.monotonic() > end:
                self._letting_go = None
                if answer is None or not answer.success:
                    why = "no answer" if answer is None else answer.message
                    self._tell(f"the drives may have torque still: {self._name}: {why}")
        if self._has_torque and not leads and not self._is_enabling:
            self.let_go()

    def let_go(self) -> None:
        """Take torque away."""
        if self._has_torque:
            self._has_torque = False
            future = self._client.call_async(SetBool.Request(data=False))
            self._letting_go = future, time.monotonic() + ANSWER_TIME
