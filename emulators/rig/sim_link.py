"""A byte link and a clock that advance the virtual time of a rig."""

from __future__ import annotations

from typing import Final

from tickrig.emulators.rig.port import ByteEnd
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_waits import Looks
from tickrig.host.links.link import LinkClosed, LinkError
from tickrig.wire.instant import NEVER

_LOOKING: Final = "receive with a timeout"


class SimLink:
    """A host's `Link[bytes]` to an emulated serial line, in virtual time.

    While a method of the link waits, it advances the time of the rig.

    Args:
        rig: the rig to advance.
        end: host's end of a serial line of the rig.
    """

    def __init__(self, rig: Rig, end: ByteEnd) -> None:
        self._rig, self._end = rig, end
        self._closed, self._looks = False, Looks()

    @property
    def now_us(self) -> int:
        """The rig's time."""
        return self._rig.now_us

    def send(self, traffic: bytes, /) -> None:
        """Send bytes on the line; if its buffer is full, advance the time until the bytes fit.

        Args:
            traffic: bytes to send.

        Raises:
            LinkClosed: the link was closed.
        """
        self._check_open()
        while traffic:
            room = self._end.room(self.now_us)
            self._end.send(self.now_us, traffic[:room])
            traffic = traffic[room:]
            if traffic:
                if self.now_us >= self._rig.host_limit.due_us:
                    self._rig.host_limit.count(self.now_us)
                self._rig.run_for(1_000)

    def receive(self, timeout_us: int, /) -> bytes:
        """Advance the rig until bytes have arrived, and return the bytes.

        Args:
            timeout_us: longest wait in microseconds. With 0 the method only checks for bytes.

        Returns:
            The received bytes, which are empty after the time-out.

        Raises:
            LinkClosed: the link was closed.
            LinkError: the method was called too many times with the time-out 0 while the time of
                the rig did not advance. Without this error, the host would wait endlessly.
        """
        self._check_open()
        rig = self._rig
        deadline_us = rig.now_us + timeout_us
        if rig.now_us >= rig.host_limit.due_us and timeout_us > 0:
            rig.host_limit.count(rig.now_us)
        while not (data := self._end.poll(rig.now_us)) and rig.now_us < deadline_us:
            arrival_us = self._end.idle_us
            until_us = arrival_us if arrival_us != NEVER else rig.next_us
            rig.run_to(max(rig.now_us, min(until_us, deadline_us)))
        if not data and timeout_us <= 0 and (refusal := self._looks.refusal(rig.now_us, _LOOKING)):
            raise LinkError(refusal)
        return data

    def close(self) -> None:
        """Close the link; the rig is unchanged."""
        self._closed = True

    def _check_open(self) -> None:
        if self._closed:
            raise LinkClosed("the link was closed")


class RigClock:
    """Clock for RT components that advances the virtual time of a rig while it waits.

    With this clock, a system of RT components (`host.rtc.real_time`) and the emulated devices that
    the components drive run together in virtual time.

    Args:
        rig: rig that is advanced while the caller waits.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig, self._start_us = rig, rig.now_us

    def wait_until(self, t_us: int, /) -> int:
        """Advance the rig to `t_us`; return the delay."""
        late_us = self._rig.now_us - self._start_us - t_us
        if late_us < 0:
            self._rig.run_for(-late_us)
        return max(0, late_us)
