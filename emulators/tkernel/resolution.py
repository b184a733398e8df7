"""A resolution service: what it answers, and what goes wrong with it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from tickrig.device.physical import InputBank, InputSignal, OutputSignal, SignalType
from tickrig.host.rtc.ucode.cache import Fetched, SourceStatus
from tickrig.host.rtc.ucode.lookup import parse_contents
from tickrig.host.text.names import near
from tickrig.host.text.section import (
    Field,
    Schema,
    Section,
    anything,
    in_a_line,
    is_broken,
    read_section,
)
from tickrig.wire.ucode import parse_ucode

# The table of a resolution service: ucodes, their addresses, what is there.
EXAMPLE: Final = Path(__file__).with_name("example.toml").read_text("utf-8")


@dataclass(frozen=True, slots=True)
class UcodeTable:
    """What a service knows.

    Attributes:
        ucodes: what each stands for: a name of `contents`, or an address.
        contents: JSON texts by name.
    """

    ucodes: Mapping[str, str] = field(default_factory=dict)
    contents: Mapping[str, str] = field(default_factory=dict)


_SECTIONS: Final[Schema] = {
    "ucodes": Field(anything, "a table", "what each ucode stands for", "none"),
    "contents": Field(anything, "a table", "what is there", "none"),
}


def parse_table(text: str) -> UcodeTable:
    """Read a table.

    Raises:
        ValueError: it is none; the text is one line.

    >>> sorted(parse_table(EXAMPLE).contents)
    ['door', 'lift']
    """
    top = read_section(text)
    top.read(_SECTIONS)
    contents = dict(_taken(top.sub("contents"), _contents))
    targets = _taken(top.sub("ucodes"), lambda ucode, target: _target(ucode, target, contents))
    ucodes = {parse_ucode(ucode): target for ucode, target in targets}
    if mistakes := top.notes.all:
        raise ValueError(in_a_line(mistakes))
    return UcodeTable(ucodes, contents)


def _taken(
    section: Section | None, take: Callable[[str, object], str]
) -> Iterator[tuple[str, str]]:
    """Yield the keys of a section with what is taken of their values; a wrong one is noted."""
    if section is None:
        return
    for key, value in section.values.items():
        try:
            if not is_broken(value):
                yield key, take(key, value)
        except ValueError as error:
            section.wrong(str(error), key)


def _contents(name: str, found: object) -> str:
    if not (name.isascii() and name.replace("-", "").replace("_", "").isalnum()):
        raise ValueError("a name has letters, digits, - and _")
    try:
        text = json.dumps(found)
    except TypeError as error:
        raise ValueError(str(error)) from None
    parse_contents(text)
    return text


def _target(ucode: str, target: object, contents: Mapping[str, str]) -> str:
    parse_ucode(ucode)
    if isinstance(target, str) and (target in contents or target.startswith("http://")):
        return target
    hint = near(str(target), list(contents))
    raise ValueError(f"{target!r} is no name of contents and no http://...; {hint}")


_INPUTS: Final = (
    InputSignal("unreachable", "nobody can connect to it", SignalType.FAULT),
    InputSignal("slow", "each answer comes delay_ms later", SignalType.FAULT),
    InputSignal("unknown_ucode", "it knows no ucode and no contents any more", SignalType.FAULT),
    InputSignal("broken", "its answers are no addresses and no contents", SignalType.FAULT),
    InputSignal("delay_ms", "how much later, while slow", high=60_000, unit="ms", initial=3_000),
)

_OUTPUTS: Final = (
    OutputSignal("requests", "requests that arrived"),
    OutputSignal("found", "of these, answered with what was asked for"),
    OutputSignal("unknown", "of these, for what it does not know"),
)


@dataclass(frozen=True, slots=True)
class Response:
    """An answer of HTTP.

    Attributes:
        status: its code.
        text: its body.
        delay_us: how much later than usual it comes.
    """

    status: int
    text: str
    delay_us: int = 0


class ResolutionService:
    """Answers `/ucodes/UCODE` with an address, `/contents/NAME` with JSON; it does no I/O.

    Args:
        table: what it knows.
        base: its own address, such as `http://127.0.0.1:8640`.

    Attributes:
        table: it may be changed.
        inputs: its faults.
    """

    tick_us: Final = 1_000

    def __init__(self, table: UcodeTable, base: str) -> None:
        self.table, self.base = table, base
        self.inputs = InputBank(_INPUTS)
        self._counts = dict.fromkeys(("requests", "found", "unknown"), 0)

    @property
    def outputs(self) -> Mapping[str, OutputSignal]:
        """What `read` knows."""
        return {output.name: output for output in _OUTPUTS}

    @property
    def reachable(self) -> bool:
        """Whether anybody can connect."""
        return not self.inputs["unreachable"]

    def read(self, name: str, /) -> int:
        """Look at an output; KeyError if there is none of that name."""
        return self._counts[name]

    def respond(self, path: str) -> Response:
        """Answer a GET."""
        inputs = self.inputs
        delay_us = inputs["delay_ms"] * 1_000 if inputs["slow"] else 0
        text = None if inputs["unknown_ucode"] else self._find(path)
        self._counts["requests"] += 1
        self._counts["unknown" if text is None else "found"] += 1
        if text is None:
            return Response(404, "unknown\n", delay_us)
        return Response(200, "out of order" if inputs["broken"] else text, delay_us)

    def _find(self, path: str) -> str | None:
        match path.split("/"):
            case ["", "ucodes", ucode] if name := self.table.ucodes.get(ucode.upper()):
                return name if name.startswith("http://") else f"{self.base}/contents/{name}"
            case ["", "contents", name]:
                return self.table.contents.get(name)
            case _:
                return None


# A resolution service in virtual time: answers come later by a latency, never by the clock.

_LATENCY_US: Final = 4_000
"""Of an answer on the way there and back; a choice."""

_TIMEOUT_US: Final = 1_000_000
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
            return _LATENCY_US, Fetched(address, SourceStatus.FAILED, why)
        response = service.respond(address.removeprefix(service.base))
        if (took_us := _LATENCY_US + response.delay_us) > _TIMEOUT_US:
            return _TIMEOUT_US, Fetched(address, SourceStatus.FAILED, f"{address}: timed out")
        if response.status == 200:
            return took_us, Fetched(address, SourceStatus.FOUND, response.text)
        return took_us, Fetched(address, SourceStatus.UNKNOWN)


def opener(service: ResolutionService) -> Callable[[str, tuple[str, ...]], SimSource]:
    """Return what opens sources at a service."""
    return lambda name, hosts: SimSource(service)
