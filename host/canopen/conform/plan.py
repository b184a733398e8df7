"""What a run of the tester was told to do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase

from tickrig.host.canopen.conform.check import Check, Level

Stimulus = Callable[..., str]
"""Moves the inputs of the device: takes words as `input 6000:01 01`, returns what it answers.

Raises ValueError for what it cannot do.
"""


@dataclass(frozen=True, slots=True)
class Plan:
    """What was chosen.

    Attributes:
        level: what may be done to the node.
        only: names of groups or checks, with * and ?, in any case; all if empty.
        allow: indices of profile objects (6000h to 9FFFh) that may be written.
        never: indices of objects that are never written, whatever else is allowed.
        bit_rate: of the bus in bit/s, None if nobody says it.
        max_load: share of the bit rate that the tester may use, above 0 to 1.
        seed: of the order in which objects are judged; 0: that of the dictionary.
        stimulus: moves the inputs of the device, None if nobody can.
        confirm: is asked before what concerns other nodes or cannot be undone; no says no.
        longest_s: after so long no further check is begun.
        resolution_us: of the time stamps of the adapter.
        shared_host: the node may be a process of this machine, and late when this one is.
    """

    level: Level = Level.READ_ONLY
    only: tuple[str, ...] = ()
    allow: frozenset[int] = frozenset()
    never: frozenset[int] = frozenset()
    bit_rate: int | None = None
    max_load: float = 0.3
    seed: int = 0
    stimulus: Stimulus | None = None
    confirm: Callable[[str], bool] = lambda question: False
    longest_s: float = 1_800
    resolution_us: int = 1_000
    shared_host: bool = False

    def chooses(self, check: Check) -> bool:
        """Say whether a check was chosen: by its level, and by its name or group."""
        if check.level > self.level:
            return False
        named = (check.id.upper(), check.group)
        return not self.only or any(
            fnmatchcase(name, pattern.upper()) for pattern in self.only for name in named
        )
