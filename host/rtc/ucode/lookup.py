"""The components of position detection: reader of ucodes, settlement, interpretation."""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, Final, Generic, NamedTuple, TypeVar

from tickrig.host.links.link import Link
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc.component import ExecutionContext, ModuleSpec, RtComponent
from tickrig.host.rtc.device_component import DeviceComponent
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.rtc.ucode.cache import CacheLimits, LookupCache, OpenSource, Source
from tickrig.host.rtc.ucode.http_source import HttpSource
from tickrig.host.text.log import log_of
from tickrig.wire.errors import FieldError, WireError
from tickrig.wire.lines import LineSplitter
from tickrig.wire.rtc_types.rtc import Point2D, Time, TimedLongSeq, TimedPoint2D, TimedStringSeq
from tickrig.wire.ucode import BAUD, LineType, UcodeLine, parse_line, parse_ucode

V = TypeVar("V")

_WAIT_US: Final = 2_000_000
"""What comes later than this after it was wanted is not written: the robot is elsewhere."""

_MOST_COUNTED: Final = 2**31 - 1
_LOG: Final = log_of(__name__)


class WantedUcode(NamedTuple):
    """A ucode whose information is wanted: where that is, and when the ucode was received."""

    ucode: str
    address: str
    received: Time


class Lookup(RtComponent, Generic[V]):
    """Finds something for each ucode that arrives: in its cache, else at a service.

    No period waits for the service. What is found later is written later, with the time at
    which the ucode arrived. An entry older than `fresh` is asked for again, and serves
    meanwhile; up to `keep` it serves while the service does not answer. The cache is in memory: it
    outlives Inactive and Error, not the component.

    After each look-up and each answer the port `cache` tells hits, hits that were not fresh,
    misses, misses of what is unknown to the service, requests that failed, entries, and the age
    in ms of the entry that answered last.

    Args:
        instance_name: of the component.
        in_port: name of its InPort.
        cache: of what is found.
        open_source: makes what asks the service.

    Attributes:
        cache: what was found.
    """

    def __init__(
        self, instance_name: str, in_port: str, cache: LookupCache[V], open_source: OpenSource
    ) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self._hosts = bind("hosts", ("127.0.0.1", "localhost"))
        self._entries = bind("entries", 64, "1<=x<=4096")
        self._fresh = bind("fresh", 60.0, "0<=x<=86400", unit="s")
        self._keep = bind("keep", 3_600.0, "0<=x<=604800", unit="s")
        self._unknown = bind("unknown", 10.0, "0.1<=x<=86400", unit="s")
        self._retry = bind("retry", 1.0, "0.1<=x<=3600", unit="s")
        self.in_ = self.add_port(InPort(in_port, TimedStringSeq))
        self.cache, self._open_source = cache, open_source
        self._source: Source | None = None
        self._waiting: dict[str, tuple[WantedUcode, int]] = {}
        self._failing_since_us: int | None = None
        self._invalid = ""

    def _add_outputs(self) -> None:
        """Add the port of the cache, behind those of a subclass."""
        self.cache_state = self.add_port(OutPort("cache", TimedLongSeq))

    @abstractmethod
    def _wanted(self, value: TimedStringSeq) -> Iterable[WantedUcode]:
        """Say what is wanted for a value that arrived."""

    @abstractmethod
    def _write(self, found: list[tuple[WantedUcode, V]]) -> None:
        """Write what was found, one thing at least, all received at one time."""

    @property
    def limits(self) -> CacheLimits:
        """What the configuration says of the cache."""
        times = (self._fresh, self._keep, self._unknown, self._retry)
        return CacheLimits(self._entries.value, *(round(time.value * 1e6) for time in times))

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin to ask; also after Error."""
        self._close()
        self._source = self._open_source(self.instance_name, self._hosts.value)
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Ask no more."""
        self._close()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Take what the service said, then look up what arrived."""
        if (source := self._source) is None:
            return ReturnCode.RTC_ERROR
        before = self.cache.counts.total
        answered = self.cache.update(source, self.limits, ec.now_us)
        for address in answered:
            self._write_late(address, ec.now_us)
        while self.in_.is_new and (value := self.in_.read()) is not None:
            self._look_up(value, source, ec.now_us)
        self._watch(ec.now_us)
        if answered or before != self.cache.counts.total:
            self._write_cache_state(Time.from_us(ec.now_us))
        return ReturnCode.RTC_OK

    def _look_up(self, value: TimedStringSeq, source: Source, now_us: int) -> None:
        found = []
        for wanted in self._wanted(value):
            result = self.cache.look_up(wanted.address, source, self.limits, now_us)
            if result is not None:
                found.append((wanted, result))
            elif len(self._waiting) < self._entries.value or wanted.address in self._waiting:
                self._waiting[wanted.address] = wanted, now_us
        if found:
            self._write(found)

    def _write_late(self, address: str, now_us: int) -> None:
        """Write what has come for a ucode that still is wanted."""
        waiting, value = self._waiting.pop(address, None), self.cache.value(address)
        if waiting is not None and value is not None and now_us - waiting[1] <= _WAIT_US:
            self._write([(waiting[0], value)])

    def _write_cache_state(self, now: Time) -> None:
        counts = self.cache.counts
        numbers = (counts.hits, counts.stale, counts.misses, counts.unknown, counts.failures)
        shown = (*numbers, len(self.cache), counts.age_us // 1_000)
        self.cache_state.write(TimedLongSeq(now, tuple(min(n, _MOST_COUNTED) for n in shown)))

    def _watch(self, now_us: int) -> None:
        """Forget who waited too long; log in a line when the service fails or is back."""
        for address, (_, wanted_us) in tuple(self._waiting.items()):
            if now_us - wanted_us > _WAIT_US:
                del self._waiting[address]
        trouble, since_us = self.cache.trouble, self._failing_since_us
        if trouble and since_us is None:
            _LOG.warning("%s: the service does not answer: %s", self.instance_name, trouble)
            self._failing_since_us = now_us
        elif not trouble and since_us is not None:
            gone_s = (now_us - since_us) / 1e6
            _LOG.warning("%s: the service answers again, after %.1f s", self.instance_name, gone_s)
            self._failing_since_us = None
        if self.cache.invalid != self._invalid:
            self._invalid = self.cache.invalid
            _LOG.warning("%s: %s", self.instance_name, self._invalid)

    def _close(self) -> None:
        source, self._source = self._source, None
        self._waiting.clear()
        if source is not None:
            source.close()
            self.cache.forget_requests()


# ContentsInterpretation: information under an address becomes a place and its properties.

_FAR_M: Final = 1e6
_MOST_PROPERTIES: Final = 32
_MOST_CHARACTERS: Final = 200
"""Of a property."""


@dataclass(frozen=True, slots=True)
class Contents:
    """What is known of a place.

    Attributes:
        x_m: where it is.
        y_m: where it is, to the left of x.
        properties: `name=value` each, in the order of the names.
    """

    x_m: float
    y_m: float
    properties: tuple[str, ...]


class ContentsInterpretation(Lookup[Contents]):
    """Reads the information of places: where they are, and what they are like.

    Ports: `addresses` in, as `UcodeSettlement` writes them; out `position`, a point for each
    ucode, in m, and `place`: its ucode, then `name=value` of each property. The information
    is a JSON object with the numbers `x_m` and `y_m`; all else in it are properties. The report
    (Fig. 123) names it and its cache; all else is ours.

    Args:
        instance_name: of the component.
        open_source: makes what gets the information; HTTP unless given.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec(
        "ContentsInterpretation", "Places of ucodes and their properties, cached"
    )

    def __init__(self, instance_name: str, open_source: OpenSource = HttpSource) -> None:
        super().__init__(instance_name, "addresses", LookupCache(parse_contents), open_source)
        self.position = self.add_port(OutPort("position", TimedPoint2D))
        self.place = self.add_port(OutPort("place", TimedStringSeq))
        self._add_outputs()

    def _wanted(self, value: TimedStringSeq) -> Iterator[WantedUcode]:
        words = value.data
        for ucode, address in zip(words[::2], words[1::2], strict=False):
            yield WantedUcode(ucode, address, value.tm)

    def _write(self, found: list[tuple[WantedUcode, Contents]]) -> None:
        for wanted, contents in found:
            point = Point2D(contents.x_m, contents.y_m)
            self.position.write(TimedPoint2D(wanted.received, point))
            words = (wanted.ucode, *contents.properties)
            self.place.write(TimedStringSeq(wanted.received, words))


def parse_contents(text: str) -> Contents:
    """Read the information of a place.

    Raises:
        ValueError: it is none.

    >>> parse_contents('{"x_m": 1, "y_m": 2.5, "name": "door"}')
    Contents(x_m=1.0, y_m=2.5, properties=('name=door',))
    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise ValueError(f"{text[:60]!r} is no JSON object")
    x_m, y_m = (_metres(found.pop(name, None), name) for name in ("x_m", "y_m"))
    if len(found) > _MOST_PROPERTIES:
        raise ValueError(f"{len(found)} properties are more than {_MOST_PROPERTIES}")
    return Contents(x_m, y_m, tuple(_property(name, found[name]) for name in sorted(found)))


def _metres(value: object, name: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) <= _FAR_M:
        raise ValueError(f"{name} is a number of metres, not {json.dumps(value)[:40]}")
    return float(value)


def _property(name: str, value: object) -> str:
    text = f"{name}={value if isinstance(value, str) else json.dumps(value)}"
    if len(text) > _MOST_CHARACTERS or not text.isprintable():
        raise ValueError(f"the property {name[:40]!r} is no short line")
    return text


# UcodeSettlement: resolves a ucode to the address of its information.

_SERVICE: Final = "http://127.0.0.1:8640"
_LONGEST_ADDRESS: Final = 1_000
"""Of an address."""


class UcodeSettlement(Lookup[str]):
    """Resolves ucodes to the addresses of their information, at a resolution service.

    Ports: `ucodes` in; `addresses` out: a ucode, its address, a ucode, its address, ... Under
    `SERVICE/ucodes/UCODE` the service has the address as text. What is no ucode is counted
    in `invalid_ucodes`. The report (Fig. 123) names it and its cache; all else is ours.

    Args:
        instance_name: of the component.
        open_source: makes what asks the service; HTTP unless given.

    Attributes:
        invalid_ucodes: words that arrived and are none.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("UcodeSettlement", "Addresses of ucodes, cached")

    def __init__(self, instance_name: str, open_source: OpenSource = HttpSource) -> None:
        super().__init__(instance_name, "ucodes", LookupCache(parse_address), open_source)
        self._service = self.configuration.bind("service", _SERVICE)
        self.addresses = self.add_port(OutPort("addresses", TimedStringSeq))
        self._add_outputs()
        self.invalid_ucodes = 0

    def _wanted(self, value: TimedStringSeq) -> Iterator[WantedUcode]:
        service = self._service.value.rstrip("/")
        for word in value.data:
            try:
                ucode = parse_ucode(word)
            except FieldError:
                self.invalid_ucodes += 1
            else:
                yield WantedUcode(ucode, f"{service}/ucodes/{ucode}", value.tm)

    def _write(self, found: list[tuple[WantedUcode, str]]) -> None:
        words = (word for wanted, address in found for word in (wanted.ucode, address))
        self.addresses.write(TimedStringSeq(found[0][0].received, tuple(words)))


def parse_address(text: str) -> str:
    """Return the address that a service gave.

    Raises:
        ValueError: it is none.
    """
    address = text.strip()
    if not address.startswith("http://") or len(address) > _LONGEST_ADDRESS:
        raise ValueError(f"{address[:60]!r} is no address, http://...")
    return address


# InfraredRaysReader: lines of an infra-red reader become ucodes.

# A host of an infra-red ucode reader that waits for nothing: look for rounds later.

_SILENCE_US: Final = 1_000_000
"""How long there may be no good line: ten rounds."""


@dataclass(frozen=True, slots=True)
class Round:
    """What a reader received in one round.

    Attributes:
        number: counted by the reader, 0..65535.
        ucodes: the nearest marker first, each with the level of its signal in per cent.
        blinded: too much light left nothing to be received.
    """

    number: int
    ucodes: tuple[tuple[str, int], ...] = ()
    blinded: bool = False


class UcodeReaderClient:
    """Lets a reader listen, and takes its rounds.

    A round of which a line was lost or garbled is left out. After a second without a good line
    it begins again, and so again and again. What waited on the line before it began is dropped:
    the robot was elsewhere then.

    Args:
        link: the line.

    Raises:
        LinkClosed: the line is gone.

    Attributes:
        garbled: lines that were none.
        incomplete: rounds that were left out.
        restarts: how often it began again.
    """

    def __init__(self, link: Link[bytes]) -> None:
        self._link, self._lines = link, LineSplitter(256)
        self.garbled = self.incomplete = self.restarts = 0
        link.receive(0)
        self._begin()

    def poll(self) -> list[Round]:
        """Return the rounds that have come.

        Raises:
            LinkClosed: the line is gone.
        """
        rounds: list[Round] = []
        for raw in self._lines.push(self._link.receive(0)):
            try:
                line = parse_line(raw)
            except WireError:
                self.garbled += 1
            else:
                self._received_us = self._link.now_us
                rounds += self._take(line)
        if self._link.now_us - self._received_us > _SILENCE_US:
            self.restarts += 1
            self._begin()
        return rounds

    def close(self) -> None:
        """Let it listen no more, and give the line back."""
        self._link.send(b"\nOFF\n")
        self._link.close()

    def _begin(self) -> None:
        self._received_us = self._link.now_us
        self._begun: list[UcodeLine] = []
        self._link.send(b"\nON\n")

    def _take(self, line: UcodeLine) -> list[Round]:
        match line:
            case UcodeLine(LineType.UCODE):
                self._begun.append(line)
            case UcodeLine(LineType.READER, (_, _, _, 0)):
                self._link.send(b"ON\n")
            case UcodeLine(LineType.LIGHT, (int(number),)):
                return self._ended(Round(number, blinded=True), 0)
            case UcodeLine(LineType.ROUND, (int(number), int(count))):
                return self._ended(self._round(number), count)
            case _:  # who it is, or that it did not understand
                pass
        return []

    def _round(self, number: int) -> Round:
        lines = [line.fields for line in self._begun if line.fields[0] == number]
        return Round(number, tuple((str(ucode), int(level)) for _, ucode, level in lines))

    def _ended(self, found: Round, count: int) -> list[Round]:
        whole = len(found.ucodes) == count == len(self._begun)
        self.incomplete += not whole
        self._begun = []
        return [found] if whole else []


_OpenReader = Callable[[str], Link[bytes]]
OPEN_SERIAL: Final[_OpenReader] = partial(SerialLink, baud=BAUD)


class InfraredRaysReader(DeviceComponent[UcodeReaderClient]):
    """Lets a reader listen while it is Active, and writes what it receives in each round.

    Ports: `ucodes` (32 hex digits each, the nearest marker first, none where none was received)
    and `levels` of their signals in per cent. The report (Fig. 123) only names it; ports and
    parameters are ours. A reader that is silent is called each second; one whose line is gone
    is an Error.

    Args:
        instance_name: of the component.
        open_link: opens the line; by pyserial unless given.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("InfraredRaysReader", "Ucodes of infra-red markers")

    def __init__(self, instance_name: str, open_link: _OpenReader = OPEN_SERIAL) -> None:
        super().__init__(instance_name)
        self.device = self.configuration.bind("DeviceFileName", "/dev/ttyUSB0")
        self.ucodes = self.add_port(OutPort("ucodes", TimedStringSeq))
        self.levels = self.add_port(OutPort("levels", TimedLongSeq))
        self._open_link = open_link
        self._was_silent = self._was_blinded = False

    def open_client(self) -> UcodeReaderClient:
        """Open the line, and let the reader listen."""
        self._was_silent = self._was_blinded = False
        return UcodeReaderClient(self._open_link(self.device.value))

    def exchange(self, ec: ExecutionContext, client: UcodeReaderClient) -> None:
        """Write the rounds that have come."""
        restarts = client.restarts
        rounds = client.poll()
        for received in rounds:
            self._write(Time.from_us(ec.now_us), received)
        self._watch(rounds, client.restarts > restarts)

    def _write(self, now: Time, received: Round) -> None:
        self.ucodes.write(TimedStringSeq(now, tuple(ucode for ucode, _ in received.ucodes)))
        self.levels.write(TimedLongSeq(now, tuple(level for _, level in received.ucodes)))

    def _watch(self, rounds: list[Round], silent: bool) -> None:
        """Log in a line when the reader becomes silent or blinded, or comes back."""
        if rounds:
            blinded = rounds[-1].blinded
            if blinded != self._was_blinded:
                what = "too much light: nothing is received" if blinded else "it receives again"
                _LOG.warning("%s: %s", self.instance_name, what)
            self._was_blinded = blinded
        if silent and not self._was_silent:
            _LOG.warning("%s: the reader is silent", self.instance_name)
        elif rounds and self._was_silent:
            _LOG.warning("%s: the reader is back", self.instance_name)
        self._was_silent = not rounds and (silent or self._was_silent)
