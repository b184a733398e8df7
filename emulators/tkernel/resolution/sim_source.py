"""A resolution service in virtual time: answers come later by a latency, never by the clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.emulators.tkernel.resolution.service import ResolutionService
from tickrig.host.rtc.ucode.source import Fetched, SourceStatus

LATENCY_US: Final = 4_000
"""Of an answer on the way there and back; a choice."""

TIMEOUT_US: Final = 1_000_000
"""As long as `HttpSource` waits."""


class SimSource:
    """A `Source` at a service in the same process.

    As HTTP does it asks one thing after the other; who cannot connect knows at once.

    Args:
        service: answers.
    """

    def __init__(self, service: ResolutionService) -> None:
        self._service, self._free_us = service, 0
        self._due: list[tuple[int, Fetched]] = []

    def request(self, address: str, now_us: int) -> None:
        """Ask for what is under an address."""
        self._free_us = max(self._free_us, now_us)
        at_us, fetched = self._fetch(address)
        self._free_us += at_us
        self._due.append((self._free_us, fetched))

    def take(self, now_us: int) -> tuple[Fetched, ...]:
        """Take the requests that have ended."""
        ended = tuple(fetched for at_us, fetched in self._due if at_us <= now_us)
        self._due = self._due[len(ended) :]
        return ended

    def close(self) -> None:
        """End."""
        self._due.clear()

    def _fetch(self, address: str) -> tuple[int, Fetched]:
        """Return how long it takes, and what comes."""
        service = self._service
        if not service.reachable or not address.startswith(f"{service.base}/"):
            why = f"{address}: connection refused"
            return LATENCY_US, Fetched(address, SourceStatus.FAILED, why)
        response = service.respond(address.removeprefix(service.base))
        if (took_us := LATENCY_US + response.delay_us) > TIMEOUT_US:
            return TIMEOUT_US, Fetched(address, SourceStatus.FAILED, f"{address}: timed out")
        if response.status == 200:
            return took_us, Fetched(address, SourceStatus.FOUND, response.text)
        return took_us, Fetched(address, SourceStatus.UNKNOWN)


def opener(service: ResolutionService) -> Callable[[str, tuple[str, ...]], SimSource]:
    """Return what opens sources at a service."""
    return lambda name, hosts: SimSource(service)
