"""How late the machine was: in real time a device can be judged only by one that keeps up."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, Protocol

from tickrig.host.control.client import TIMEOUT_S
from tickrig.host.links.link import Link

LATE_US: Final = 5_000
"""Later than this the bench cannot be believed: half a period of the RRC."""

SLICE_US: Final = 10_000
"""A wait is cut into pieces of this length, so that it is seen how late each ends."""

NO_ANSWER_US: Final = round(TIMEOUT_S * 1e6)
"""How late an emulator is that does not answer."""

Ask = Callable[..., Mapping[str, object]]
"""Asks an emulator as its control socket does, with `do` and the fields by keyword."""


class Lateness(Protocol):
    """Something that may be late."""

    @property
    def late_us(self) -> int:
        """The worst since it was made."""
        ...


class PacedLink:
    """A `Link[bytes]` that sees how late its host is, between calls and in waiting.

    Attributes:
        late_us: the worst so far.
    """

    def __init__(self, link: Link[bytes]) -> None:
        self._link, self._seen_us, self.late_us = link, link.now_us, 0

    @property
    def now_us(self) -> int:
        return self._link.now_us

    def send(self, traffic: bytes, /) -> None:
        self._link.send(traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        until_us = self.now_us + timeout_us
        self._look(0)
        while True:
            wait_us = max(0, min(SLICE_US, until_us - self.now_us))
            data = self._link.receive(wait_us)
            self._look(wait_us)
            if data or self.now_us >= until_us:
                return data

    def close(self) -> None:
        self._link.close()

    def beside(self, ask: Ask) -> Ask:
        """Return `ask` as something for which the host may wait: an answer takes up to a slice."""

        def asked(do: str, **fields: object) -> Mapping[str, object]:
            self._look(0)
            answer = ask(do, **fields)
            self._look(SLICE_US)
            return answer

        return asked

    def _look(self, waited_us: int) -> None:
        """Note how much longer it took to come here than it was meant to wait."""
        now_us = self.now_us
        self.late_us = max(self.late_us, now_us - self._seen_us - waited_us)
        self._seen_us = now_us


class EmulatorPace:
    """How late an emulator was, which knows the worst since its own start alone.

    Args:
        ask: asks it.
    """

    def __init__(self, ask: Ask) -> None:
        self._ask = ask
        self._steps_before, _ = self._status()

    @property
    def late_us(self) -> int:
        """Return the worst, 0 if no step was late since this was made, or it is gone."""
        try:
            steps, late_us = self._status()
        except TimeoutError:
            return NO_ANSWER_US
        except OSError:
            return 0
        return late_us if steps > self._steps_before else 0

    def _status(self) -> tuple[int, int]:
        status = self._ask("status")
        steps, late_us = status["late_steps"], status["late_us"]
        assert isinstance(steps, int)
        assert isinstance(late_us, int)
        return steps, late_us


def too_slow(parts: Mapping[str, Lateness]) -> str:
    """Say which parts of a bench were too late to judge a device; empty if none was."""
    late = {name: part.late_us for name, part in parts.items()}
    if max(late.values(), default=0) <= LATE_US:
        return ""
    times = ", ".join(f"{name} up to {late_us / 1_000:.0f} ms" for name, late_us in late.items())
    return f"the machine was too slow: {times} late"
