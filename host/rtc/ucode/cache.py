"""A cache in front of a source that may be slow or unavailable."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Generic, Protocol, TypeVar

# Asynchronous sources of information about ucodes.


class SourceStatus(Enum):
    """Outcome of a request."""

    FOUND = "found"
    UNKNOWN = "unknown"  # there is nothing under this address
    FAILED = "failed"  # no answer, or an invalid one


@dataclass(frozen=True, slots=True)
class Fetched:
    """Result of a finished request to a `Source`.

    Attributes:
        address: address that was requested.
        status: outcome of the request.
        text: text at the address, or the reason if the request failed.
    """

    address: str
    status: SourceStatus
    text: str = ""


class Source(Protocol):
    """Interface of a source that returns the text at an address without blocking its caller.

    Each request ends with a result, at the latest after a time-out. One source is an HTTP client
    with its own thread. Another source uses an emulated service in virtual time.
    """

    def request(self, address: str, now_us: int) -> None:
        """Request the text at an address."""

    def take(self, now_us: int) -> tuple[Fetched, ...]:
        """Return the results of the requests that have ended since the last call."""
        ...

    def close(self) -> None:
        """Close the source. Pending requests get no answer."""


OpenSource = Callable[[str, tuple[str, ...]], Source]
"""Function that makes a source for a client, with the hosts that addresses may name."""


_V = TypeVar("_V")


@dataclass(frozen=True, slots=True)
class CacheLimits:
    """Settings of a `LookupCache`: its size, and the ages at which its entries expire.

    Attributes:
        entries: maximum number of entries. The least recently used entry is removed first.
        fresh_us: age in us after which an entry is requested again. It remains in use until the
            answer arrives.
        keep_us: age in us after which an entry is no longer used.
        unknown_us: time in us before an address at which nothing was found is requested again.
        retry_us: time in us before a failed request is repeated.
    """

    entries: int
    fresh_us: int
    keep_us: int
    unknown_us: int
    retry_us: int


@dataclass(slots=True)
class _CacheCounts:
    """The numbers of look-ups in a cache by result.

    Attributes:
        hits: number of look-ups answered at once.
        stale: number of hits that were answered by an entry that is no longer fresh.
        misses: number of look-ups not answered at once.
        unknown: number of misses because the address is unknown.
        failures: number of requests to the source that failed.
        age_us: age of the entry that answered last.
    """

    hits: int = 0
    stale: int = 0
    misses: int = 0
    unknown: int = 0
    failures: int = 0
    age_us: int = 0

    @property
    def total(self) -> int:
        """Sum of look-ups and failed requests.

        If this sum is the same as before, no count has changed.
        """
        return self.hits + self.misses + self.failures


@dataclass(slots=True)
class _Entry(Generic[_V]):
    """An entry of the cache.

    `next_us` is the time from which its address may be requested again.
    """

    value: _V | None = None
    fetched_us: int = 0
    next_us: int = 0
    pending: bool = False
    unknown: bool = False


class LookupCache(Generic[_V]):
    """Cache that stores the values of addresses, and requests missing values from a source.

    If the source is not available, the cache returns old values.

    Args:
        parse: function that makes a value from the text at an address. If it raises ValueError, the
            address counts as unknown.

    Attributes:
        counts: numbers of results, such as hits, misses and failed requests.
        trouble: reason why the latest request failed, empty if it succeeded.
        invalid: latest text that `parse` rejected, with the reason.
    """

    def __init__(self, parse: Callable[[str], _V]) -> None:
        self._parse, self._entries = parse, OrderedDict[str, _Entry[_V]]()
        self.counts, self.trouble, self.invalid, self._pending = _CacheCounts(), "", "", 0

    def __len__(self) -> int:
        """Return the number of addresses with a value."""
        return sum(entry.value is not None for entry in self._entries.values())

    def look_up(self, address: str, source: Source, limits: CacheLimits, now_us: int) -> _V | None:
        """Return the cached value at an address, or None if there is none that may be used.

        If there is no fresh value, the address is requested from the source. A later call of
        `update` processes the result.

        Args:
            address: address to look up.
            source: source of values that are not in the cache.
            limits: settings of the cache.
            now_us: present time in us.
        """
        entry = self._entries.setdefault(address, _Entry())
        self._entries.move_to_end(address)
        if not entry.pending and now_us >= entry.next_us and self._pending < limits.entries:
            entry.pending = True
            self._pending += 1
            source.request(address, now_us)
        while len(self._entries) > limits.entries:
            self._entries.popitem(last=False)
        return self._answer(entry, limits, now_us)

    def update(self, source: Source, limits: CacheLimits, now_us: int) -> tuple[str, ...]:
        """Process results of the source. Return the addresses that now have a value."""
        ended = source.take(now_us)
        self._pending -= len(ended)
        return tuple(fetched.address for fetched in ended if self._take(fetched, limits, now_us))

    def value(self, address: str) -> _V | None:
        """Return the cached value at an address regardless of its age, or None if there is none.

        The call does not count as a look-up.
        """
        return entry.value if (entry := self._entries.get(address)) is not None else None

    def forget_requests(self) -> None:
        """Drop all pending requests, because the source was closed."""
        self._pending = 0
        for entry in self._entries.values():
            entry.pending = False

    def _answer(self, entry: _Entry[_V], limits: CacheLimits, now_us: int) -> _V | None:
        counts, age_us = self.counts, now_us - entry.fetched_us
        if entry.value is None or age_us > limits.keep_us:
            counts.misses += 1
            counts.unknown += entry.unknown
            return None
        counts.hits += 1
        counts.stale += age_us > limits.fresh_us
        counts.age_us = age_us
        return entry.value

    def _take(self, fetched: Fetched, limits: CacheLimits, now_us: int) -> bool:
        entry = self._entries.get(fetched.address)
        if entry is None:
            return False
        entry.pending = False
        if fetched.status is SourceStatus.FAILED:
            self.counts.failures += 1
            self.trouble, entry.next_us = fetched.text, now_us + limits.retry_us
            return False
        self.trouble, entry.value = "", self._parsed(fetched)
        known = entry.value is not None
        entry.fetched_us, entry.unknown = now_us, not known
        entry.next_us = now_us + (limits.fresh_us if known else limits.unknown_us)
        return known

    def _parsed(self, fetched: Fetched) -> _V | None:
        if fetched.status is SourceStatus.UNKNOWN:
            return None
        try:
            return self._parse(fetched.text)
        except ValueError as error:
            self.invalid = f"{fetched.address}: {error}"
            return None
