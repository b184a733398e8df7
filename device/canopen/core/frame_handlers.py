"""Which of the services of a slave handle which frames."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import Final, NamedTuple

from tickrig.device.canopen.core.service import Handler, Service
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import NmtState

REMOTE: Final = 0x2000_0000

shared: Final[Callable[[frozenset[int]], frozenset[int]]] = lru_cache(frozenset)
"""Returns the set that all slaves have which name the same; it then stays in the cache."""


def frame_handlers(services: Iterable[Service], state: NmtState) -> dict[int, Handler]:
    """Return the handlers by CAN-ID, those of remote frames by `REMOTE | CAN-ID`."""
    handlers: dict[int, Handler] = {}
    for service in services:
        for can_id, handler in service.handlers(state):
            first = handlers.get(can_id)
            handlers[can_id] = _Both(first, handler).handle if first else handler
        for can_id, handler in service.remote_handlers(state):
            handlers[REMOTE | can_id] = handler
    return handlers


class _Both(NamedTuple):
    """Two handlers of one CAN-ID: two services may listen to it."""

    first: Handler
    second: Handler

    def handle(self, frame: CanFrame) -> None:
        self.first(frame)
        self.second(frame)
