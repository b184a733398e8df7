"""The frames that a rule speaks of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.decode.filter_terms import Test, signal_reader
from tickrig.host.canmon.model.frames.ident import ERROR, any_ident
from tickrig.host.canmon.model.frames.record import Record
from tickrig.wire.can_error import ErrorFrame


@dataclass(frozen=True, slots=True)
class Event:
    """Frames that pass a filter.

    Attributes:
        text: as it is written.
        matches: says whether a frame is one.
        paths: the signals that it names.
        is_signal: it is one signal, and nothing that this is compared with.
        has_node: it names a node.
    """

    text: str
    matches: Test
    paths: tuple[str, ...] = ()
    is_signal: bool = False
    has_node: bool = False

    def carriers(self) -> Callable[[Decoded], bool]:
        """Return what says whether a frame carries a signal that is named."""
        finders = [signal_reader(path) for path in self.paths]
        return lambda decoded: any(find(decoded) is not None for find in finders)

    def value_of(self) -> Callable[[Record, Decoded], Signal | None]:
        """Return what finds the value of a frame: the signal, or the first one of its kind."""
        matches = self.matches
        if self.is_signal:
            finders = [signal_reader(path) for path in self.paths]
            return lambda record, decoded: next(filter(None, (f(decoded) for f in finders)), None)
        return lambda record, decoded: (
            decoded.signals[0] if decoded.signals and matches(record, decoded) else None
        )


EVERY: Final = Event("all frames", lambda record, decoded: True)

Sender = tuple[str, int]
"""A bus and an identifier on it."""


def sender_of(record: Record) -> Sender:
    """Return where a frame came from; error frames are one."""
    frame = record.frame
    return record.channel, ERROR if isinstance(frame, ErrorFrame) else any_ident(frame)


def said(decoded: Decoded) -> str:
    """Write what a frame says, for a finding."""
    node = "" if decoded.node is None else f" of node {decoded.node}"
    return f"{decoded.kind}{node}: {decoded.text}".removesuffix(": ")
