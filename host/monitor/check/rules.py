"""All rules of a check, as values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.monitor.check.frame_rules import (
    KnownIds,
    NodesPresent,
    NoEmcy,
    NoErrorFrames,
    NoReboot,
    NoSdoAbort,
)
from tickrig.host.monitor.check.rule import Rule
from tickrig.host.monitor.check.time_rules import (
    Heartbeat,
    HeartbeatTimes,
    MaxGap,
    MaxLoad,
)

NO_LOSS: Final = "no-loss"
"""The rule that no frame was lost and every line of a log is one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """What traffic must keep.

    Attributes:
        max_load: percent of the bit rate in any second, None for no limit.
        bit_rate: bits a second, where nothing else tells it; no rule by itself.
        no_emcy: no EMCY but error reset.
        no_sdo_abort: no aborted SDO transfer.
        no_error_frames: no error frame.
        no_reboot: no boot-up of a node that was heard, without an NMT reset.
        no_loss: no frame lost, no line of a log that is none.
        heartbeats: when those of some nodes come.
        nodes: nodes that must be heard.
        max_gaps: identifiers and the longest gap of each, microseconds.
        known: all identifiers that may come, None for any.
        others: what makes further rules, those of installed packages.
    """

    max_load: float | None = None
    bit_rate: int | None = None
    no_emcy: bool = False
    no_sdo_abort: bool = False
    no_error_frames: bool = False
    no_reboot: bool = False
    no_loss: bool = False
    heartbeats: tuple[HeartbeatTimes, ...] = ()
    nodes: tuple[int, ...] = ()
    max_gaps: tuple[tuple[int, int], ...] = ()
    known: frozenset[int] | None = None
    others: tuple[Callable[[], Rule], ...] = ()

    def names(self) -> list[str]:
        """Return the names of all rules, for a report."""
        names = ["max-load"] * (self.max_load is not None) + [NO_LOSS] * self.no_loss
        return names + [rule.name for rule in self.make()]

    def make(self) -> list[Rule]:
        """Return new rules about frames."""
        made: list[Rule] = []
        made += [NoEmcy()] * self.no_emcy
        made += [NoSdoAbort()] * self.no_sdo_abort
        made += [NoErrorFrames()] * self.no_error_frames
        made += [NoReboot()] * self.no_reboot
        made += [Heartbeat(times) for times in self.heartbeats]
        made += [NodesPresent(self.nodes)] * bool(self.nodes)
        made += [MaxGap(*gap) for gap in self.max_gaps]
        made += [KnownIds(self.known)] if self.known is not None else []
        made += [make() for make in self.others]
        return made

    def load(self, bit_rate: int | None) -> MaxLoad | None:
        """Return the rule about load; ValueError if it needs a bit rate and there is none."""
        if self.max_load is None:
            return None
        bit_rate = self.bit_rate if bit_rate is None else bit_rate
        if bit_rate is None:
            raise ValueError("a limit of the load needs the bit rate: give -b, as -b 500000")
        return MaxLoad(self.max_load, bit_rate)
