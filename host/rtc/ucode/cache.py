"""A cache before a source that may be slow, or gone."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Generic, Protocol, TypeVar

# Asynchronous sources of information about ucodes.


class SourceStatus(Enum):
    """How a request ended."""

    FOUND = "found"
    UNKNOWN = "unknown"  # there is nothing under this address
    FAILED = "failed"  # no answer, or an invalid one


@dataclass(frozen=True, slots=True)
class Fetched:
    """The end of a request.

    Attributes:
        address: the requested address.
        status: how the request ended.
        text: the text at this address; the reason if the request failed.
    """

    address: str
    status: SourceStatus
    text: str = ""


class Source(Protocol):
    """Gets texts by their addresses, without waiting; each request ends, if only by a time-out.

    In real time it is an HTTP client in its own thread; in virtual time a table with a delay.
    """

    def request(self, address: str, now_us: int) -> None:
        """Ask for what is under an address."""

    def take(self, now_us: int) -> tuple[Fetched, ...]:
        """Take the requests that have ended."""
        ...

    def close(self) -> None:
        """End; pending requests get no answer."""


OpenSource = Callable[[str, tuple[str, ...]], Source]
"""Makes a source for who asks, with the hosts that addresses may name."""


_V = TypeVar("_V")


@dataclass(frozen=True, slots=True)
class CacheLimits:
    """Size of a cache, and life times of its entries.

    Attributes:
        entries: largest number of entries; the least recently used one is removed first.
        fresh_us: an older entry is requested again; until the answer it remains in use.
        keep_us: an older entry is not used.
        unknown_us: time before an unknown ucode is requested again.
        retry_us: time before a failed request is repeated.
    """

    entries: int
    fresh_us: int
    keep_us: int
    unknown_us: int
    retry_us: int


@dataclass(slots=True)
class _CacheCounts:
    """The numbers of look-ups in a cache by their results.

    Attributes:
        hits: look-ups answered at once.
        stale: hits that were answered by an entry that is no longer fresh.
        misses: look-ups not answered at once.
        unknown: misses because the address is unknown.
        failures: requests to the source that failed.
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
        """How many questions there were, and how many requests that failed: a sign of news."""
        return self.hits + self.misses + self.failures


@dataclass(slots=True)
class _Entry(Generic[_V]):
    """What is known of an address; `next_us` is when it may be asked for again."""

    value: _V | None = None
    fetched_us: int = 0
    next_us: int = 0
    pending: bool = False
    unknown: bool = False


class LookupCache(Generic[_V]):
    """Holds values by their addresses; while the source does not answer, old values are used.

    Args:
        parse: makes a value of a text; after a ValueError the address counts as unknown.

    Attributes:
        counts: the numbers of look-ups by their results.
        trouble: why the latest request failed; empty if it succeeded.
        invalid: the latest text that was not a value, and why.
    """

    def __init__(self, parse: Callable[[str], _V]) -> None:
        self._parse, self._entries = parse, OrderedDict[str, _Entry[_V]]()
        self.counts, self.trouble, self.invalid, self._pending = _CacheCounts(), "", "", 0

    def __len__(self) -> int:
        """Return how many addresses have a value."""
        return sum(entry.value is not None for entry in self._entries.values())

    def look_up(self, address: str, source: Source, limits: CacheLimits, now_us: int) -> _V | None:
        """Return the value under an address, None if there is none now; it may be asked for."""
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
        """Take what came from the source; return the addresses that have a value now."""
        ended = source.take(now_us)
        self._pending -= len(ended)
        return tuple(fetched.address for fetched in ended if self._take(fetched, limits, now_us))

    def value(self, address: str) -> _V | None:
        """Return what is held under an address, however old; this is no look-up."""
        return entry.value if (entry := self._entries.get(address)) is not None else None

    def forget_requests(self) -> None:
        """Expect nothing more: the source was closed."""
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
