"""A resolution service: its answers and its faults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.emulators.tkernel.ucode_table import UcodeTable
from tickrig.host.rtc.ucode.cache import Fetched, SourceStatus

_INPUTS: Final = (
    InputSignal("unreachable", "no client can connect to it", SignalType.FAULT),
    InputSignal("slow", "each answer comes delay_ms later", SignalType.FAULT),
    InputSignal("unknown_ucode", "it no longer knows any ucode or contents", SignalType.FAULT),
    InputSignal("broken", "its answers are not addresses or contents", SignalType.FAULT),
    InputSignal("delay_ms", "how much later, while slow", high=60_000, unit="ms", initial=3_000),
)

_OUTPUTS: Final = (
    OutputSignal("requests", "requests that arrived"),
    OutputSignal("found", "of these, answered"),
    OutputSignal("unknown", "of these, for unknown addresses"),
)


@dataclass(frozen=True, slots=True)
class _Response:
    """An answer of HTTP.

    Attributes:
        status: status code of the answer.
        text: body of the answer.
        delay_us: additional delay in us.
    """

    status: int
    text: str
    delay_us: int = 0


class ResolutionService:
    """An emulated ucode resolution service, without any network I/O.

    It answers requests for `/ucodes/UCODE` with an address, and for `/contents/NAME` with JSON.

    Args:
        table: ucodes and contents.
        base: address of the service, such as `http://127.0.0.1:8640`.

    Attributes:
        table: ucodes and contents, which may be changed.
        inputs: inputs that switch faults of the service on and off, such as `unreachable`, and the
            input `delay_ms`.
    """

    tick_us: Final = 1_000

    def __init__(self, table: UcodeTable, base: str) -> None:
        self.table, self.base = table, base
        self.inputs = InputBank(_INPUTS)
        self._counts = dict.fromkeys(("requests", "found", "unknown"), 0)

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """The outputs that `read` accepts."""
        return {output.name: output for output in _OUTPUTS}

    @property
    def reachable(self) -> bool:
        """Whether clients can connect."""
        return not self.inputs["unreachable"]

    def read(self, name: str, /) -> int:
        """Return the present value of an output; raise KeyError if the name is unknown."""
        return self._counts[name]

    def respond(self, path: str) -> _Response:
        """Answer a GET."""
        inputs = self.inputs
        delay_us = inputs["delay_ms"] * 1_000 if inputs["slow"] else 0
        text = None if inputs["unknown_ucode"] else self._find(path)
        self._counts["requests"] += 1
        self._counts["unknown" if text is None else "found"] += 1
        if text is None:
            return _Response(404, "unknown\n", delay_us)
        return _Response(200, "out of order" if inputs["broken"] else text, delay_us)

    def _find(self, path: str) -> str | None:
        match path.split("/"):
            case ["", "ucodes", ucode] if name := self.table.ucodes.get(ucode.upper()):
                return name if name.startswith("http://") else f"{self.base}/contents/{name}"
            case ["", "contents", name]:
                return self.table.contents.get(name)
            case _:
                return None


# A resolution service in virtual time: answers come after a latency.

_LATENCY_US: Final = 4_000
"""Round-trip time of an answer, which is an arbitrary choice."""

_TIMEOUT_US: Final = 1_000_000
"""The time-out of `HttpSource`."""


class SimSource:
    """Client of an emulated ucode resolution service in the same process; it is a `Source`.

    As with HTTP, requests are sent one after the other. A failed connection is reported at once.

    Args:
        service: the service.
    """

    def __init__(self, service: ResolutionService) -> None:
        self._service, self._free_us = service, 0
        self._due: list[tuple[int, Fetched]] = []

    def request(self, address: str, now_us: int) -> None:
        """Request the content of an address."""
        self._free_us = max(self._free_us, now_us)
        at_us, fetched = self._fetch(address)
        self._free_us += at_us
        self._due.append((self._free_us, fetched))

    def take(self, now_us: int) -> tuple[Fetched, ...]:
        """Return the finished requests."""
        ended = tuple(fetched for at_us, fetched in self._due if at_us <= now_us)
        self._due = self._due[len(ended) :]
        return ended

    def close(self) -> None:
        """Stop the source."""
        self._due.clear()

    def _fetch(self, address: str) -> tuple[int, Fetched]:
        """Return the duration and the answer of a request."""
        service = self._service
        if not service.reachable or not address.startswith(f"{service.base}/"):
            why = f"{address}: connection refused"
            return _LATENCY_US, Fetched(address, SourceStatus.FAILED, why)
        response = service.respond(address.removeprefix(service.base))
        if (took_us := _LATENCY_US + response.delay_us) > _TIMEOUT_US:
            return _TIMEOUT_US, Fetched(address, SourceStatus.FAILED, f"{address}: timed out")
        if response.status == 200:
            return took_us, Fetched(address, SourceStatus.FOUND, response.text)
        return took_us, Fetched(address, SourceStatus.UNKNOWN)


def opener(service: ResolutionService) -> Callable[[str, tuple[str, ...]], SimSource]:
    """Return a function that opens sources for a service."""
    return lambda name, hosts: SimSource(service)
