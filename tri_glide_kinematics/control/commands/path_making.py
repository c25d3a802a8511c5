"""Puts a path together, in pieces, and gives it to the motion engine."""

from __future__ import annotations

from collections.abc import Callable

from tri_glide_kinematics.control.commands.inbox import TargetPath
from tri_glide_kinematics.control.errors import CommandRefusedError
from tri_glide_kinematics.errors import KinematicsError, Refusal
from tri_glide_kinematics.interruptible import Interruptible
from tri_glide_kinematics.motion.engine import MotionEngine
from tri_glide_kinematics.motion.path import PlatformPath


class PathMaking:
    """The path that is begun, until the engine has it."""

    def __init__(self, engine: MotionEngine) -> None:
        """Give paths to ``engine``."""
        self._engine = engine
        self._making: Interruptible[PlatformPath] | None = None
        self._extends = False

    @property
    def goes_on(self) -> bool:
        """Whether a path is still put together."""
        return self._making is not None

    def begin(self, target: TargetPath) -> None:
        """Begin with a path, in place of another.

        Raises:
            CommandRefusedError: if it goes on from a path that is not followed any more.
        """
        self._extends = target.extends
        if self._extends and self._engine.driven_path is None:
            text = "the path that it goes on from is not followed any more"
            raise CommandRefusedError(text, Refusal.NO_PATH)
        self._making = target.make(self._engine.target if self._extends else None)

    def give_up(self) -> None:
        """Forget what is begun."""
        self._making = None

    def work(self, may_go_on: Callable[[], bool]) -> KinematicsError | None:
        """Go on by one piece at least, if there is something, and while ``may_go_on``.

        Returns:
            Why the path is refused, if it is.
        """
        while self._making is not None:
            try:
                next(self._making)
            except StopIteration as end:
                self._making = None
                return self._refusal_of(end.value)
            except KinematicsError as error:
                self._making = None
                return error
            except Exception as error:
                # It is made of what somebody has sent: no bytes end more than their own command.
                self._making = None
                text = f"there is no path: {type(error).__name__}: {error}"
                return CommandRefusedError(text, Refusal.MESSAGE)
            if not may_go_on():
                break
        return None

    def _refusal_of(self, path: PlatformPath) -> KinematicsError | None:
        """Give a path to the engine, and return why it refuses it, if it does."""
        try:
            if self._extends:
                self._engine.extend(path)
            else:
                self._engine.follow(path)
        except KinematicsError as error:
            return error
        return None
