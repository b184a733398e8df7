"""A heartbeat that runs though 1017h does not say so: told, and told again when it is gone."""

from __future__ import annotations

from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.frame_pattern import matches
from tickrig.host.canopen.conform.bus.periods import MS_US
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID

SPARE_MS: Final = 1_000
MISSED: Final = 3
"""So many periods without a heartbeat, and it is gone."""


class StrayHeartbeat:
    """What was heard of the heartbeat of a node before the run.

    Args:
        exchange: the bus.
        node_id: of the node, 1..127.

    Attributes:
        stamps: when heartbeats came before the run, in bus time.
        finding: that 1017h does not say so, for people; empty if it does.
        unrestored: that it is gone after the run, for people; empty if it is not.
    """

    def __init__(self, exchange: Exchange, node_id: int) -> None:
        self._exchange, self._can_id = exchange, f"{ERROR_CONTROL_COB_ID + node_id:03X}"
        self._pattern = f"{self._can_id}#[0-7][45F]"
        self.stamps: list[int] = []
        self._period_ms: int | None = 0
        self.finding = self.unrestored = ""

    def hear(self) -> None:
        """Take what has come so far; answers to node guarding are no heartbeat."""
        heard = self._exchange.unread(self._can_id)
        if not any(text.startswith(f"{self._can_id}#R") for _, text in heard):
            self.stamps = [at_us for at_us, text in heard if matches(self._pattern, text)]

    def compare(self, period_ms: int | None) -> None:
        """Hold what was heard against 1017h, None if the node has none."""
        self._period_ms = period_ms
        if not period_ms:
            self.finding = f"{self._text()}, but {self._said()}"

    def look_again(self) -> None:
        """Listen after the run: what 1017h does not say, nobody can switch on again."""
        each_ms = self._each_ms()
        if not self.finding or not each_ms:
            return
        self._exchange.begin((MISSED * each_ms + SPARE_MS) * MS_US)
        if not self._exchange.collect(self._pattern, MISSED * each_ms):
            self.unrestored = f"{self._text()}: gone, and {self._said()} as before"

    def _each_ms(self) -> int:
        stamps = self.stamps
        return round((stamps[-1] - stamps[0]) / max(1, len(stamps) - 1) / MS_US) if stamps else 0

    def _text(self) -> str:
        each_ms = self._each_ms()
        return f"heartbeat each {each_ms} ms" if each_ms else "a heartbeat was heard"

    def _said(self) -> str:
        return "the node has no 1017h" if self._period_ms is None else "1017h = 0"
