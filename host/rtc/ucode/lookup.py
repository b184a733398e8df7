"""The common parts of settlement and interpretation: addresses, a cache, and a source."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
from typing import Final, Generic, NamedTuple, TypeVar

from tickrig.host.rtc.component import ExecutionContext, RtComponent
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.rtc.ucode.cache import CacheLimits, LookupCache, OpenSource, Source
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.rtc import Time, TimedLongSeq, TimedStringSeq

_V = TypeVar("_V")

_WAIT_US: Final = 2_000_000
"""Time after which a result is not written, because the robot is at another place."""

_MOST_COUNTED: Final = 2**31 - 1
_LOG: Final = log_of(__name__)


class WantedUcode(NamedTuple):
    """A received ucode for which a component looks up information at an address.

    Attributes:
        ucode: ucode of the marker.
        address: address at which the information is looked up.
        received: time at which the ucode was received.
    """

    ucode: str
    address: str
    received: Time


class Lookup(RtComponent, Generic[_V]):
    """A component that looks up each arriving ucode in its cache, and if needed in a service.

    Periods do not wait for the service. A result that arrives in a later period is written in that
    period, with the time at which the ucode arrived. An entry older than `fresh` is requested
    again. The entry remains in use until the service answers, up to `keep`. The cache is in memory.
    The cache is kept in Inactive and Error, and lost when the component ends.

    After each look-up and each answer, the port `cache` gives these numbers: hits, hits that were
    not fresh, misses, misses of ucodes that the service does not know, failed requests, entries,
    and the age in ms of the entry that answered last.

    Args:
        instance_name: name of the component.
        in_port: name of the component's InPort.
        cache: settings of the cache.
        open_source: function that creates the client of the service.

    Attributes:
        cache: cache of the results.
    """

    def __init__(
        self, instance_name: str, in_port: str, cache: LookupCache[_V], open_source: OpenSource
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
        """Add the port of the cache after the ports of a subclass."""
        self.cache_state = self.add_port(OutPort("cache", TimedLongSeq))

    @abstractmethod
    def _wanted(self, value: TimedStringSeq) -> Iterable[WantedUcode]:
        """Return the request for a value that arrived."""

    @abstractmethod
    def _write(self, found: list[tuple[WantedUcode, _V]]) -> None:
        """Write the results, of which there is at least one.

        All have the same time of reception.
        """

    @property
    def limits(self) -> CacheLimits:
        """Limits of the cache in the configuration."""
        times = (self._fresh, self._keep, self._unknown, self._retry)
        return CacheLimits(self._entries.value, *(round(time.value * 1e6) for time in times))

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Create the client of the service, also after Error."""
        self._close()
        self._source = self._open_source(self.instance_name, self._hosts.value)
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Close the client of the service."""
        self._close()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Process answers of the service, then look up the arrived ucodes."""
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
        """Write the results of ucodes that are still wanted."""
        waiting, value = self._waiting.pop(address, None), self.cache.value(address)
        if waiting is not None and value is not None and now_us - waiting[1] <= _WAIT_US:
            self._write([(waiting[0], value)])

    def _write_cache_state(self, now: Time) -> None:
        counts = self.cache.counts
        numbers = (counts.hits, counts.stale, counts.misses, counts.unknown, counts.failures)
        shown = (*numbers, len(self.cache), counts.age_us // 1_000)
        self.cache_state.write(TimedLongSeq(now, tuple(min(n, _MOST_COUNTED) for n in shown)))

    def _watch(self, now_us: int) -> None:
        """Drop ucodes that waited too long. Log when the service fails or works again."""
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
