"""The waits of a host on a rig, and what it is told that would wait for ever."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from typing import Final

from serial.serialutil import SerialException

from tickrig.device.twin import Copyable
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import Looks, OneThread

LOG = logging.getLogger(__name__)

LONGEST_US: Final = 3_600_000_000
"""A wait without a timeout ends with an exception after an hour."""

INSTEAD: Final = "read and write in the thread that made the rig"

NO_ASYNCIO: Final = (
    "a port in virtual time has no file descriptor; hosts that wait on one (asyncio, select) run in"
    " real time: --bench-mode real"
)

LOOKING: Final = "read with a timeout, or let time.sleep be that of the rig"


class HostWaits(Copyable):
    """Steps a rig while a host waits, in the thread that made it and in no other.

    Args:
        rig: the rig.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._thread = OneThread()
        self._looks = Looks()

    def check_thread(self, name: str) -> None:
        """Raise SerialException, now and ever after, if a second thread uses a port.

        Args:
            name: the port.
        """
        if threading.current_thread().name.startswith("asyncio"):  # of an event loop's executor
            raise SerialException(f"{name}: {NO_ASYNCIO}")
        if refusal := self._thread.refusal(name, INSTEAD):
            raise SerialException(refusal)

    def deadline_us(self, timeout_s: float | None) -> int:
        """Return when a timeout that begins now ends; without one, when `give_up` says so.

        Args:
            timeout_s: the timeout in seconds, None if there is none.
        """
        return self.rig.now_us + (LONGEST_US if timeout_s is None else round(timeout_s * 1e6))

    def give_up(self, timeout_s: float | None) -> None:
        """Raise SerialException if there was no timeout: the host would wait for ever.

        Args:
            timeout_s: the timeout that is over.
        """
        if timeout_s is None:
            raise SerialException("nothing came for an hour, and no timeout was given")

    def look(self) -> None:
        """Count a look that found nothing.

        Raises:
            SerialException: there were too many at one instant: the host would wait for ever.
        """
        if refusal := self._looks.refusal(self.rig.now_us, LOOKING):
            raise SerialException(refusal)

    def wait(
        self, until_us: int, due_us: Callable[[], int], done: Callable[[], bool] = lambda: False
    ) -> None:
        """Let time pass until something is due.

        Args:
            until_us: until when at most.
            due_us: returns when it will be, `NEVER` if that is not known.
            done: returns whether the wait is to end at once.
        """
        rig = self.rig
        at_us = due_us()
        if at_us > until_us:
            rig.run_until(lambda: due_us() <= until_us or done(), until_us - rig.now_us)
            at_us = due_us()
        rig.run_until(done, max(0, min(at_us, until_us) - rig.now_us))
