"""What differs from one RRC to another, and what the manual leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from tickrig.device.twin import Immutable
from tickrig.wire.rrc.replies import POWER_ON_TRIGGER, RrcEvent


class FailTarget(Enum):
    """Where a failed power-on leads (DECISION R3)."""

    WAIT = "wait"  # wait for the button again, settings kept
    INITIALIZE = "initialize"  # through Initialize, settings wiped


@dataclass(frozen=True, slots=True)
class RrcConfig(Immutable):
    """Configuration of an emulated RRC. Times are in ticks of 10 ms.

    Attributes:
        device_name: answer of `device`.
        version: answer of `version`.
        date: answer of `date`.
        power_on_event: `PowerOnTrigger` as in the field, or `PowerOn` as in the
            manual's event table (DECISION R7).
        power_on_fail_target: where transition 3 leads (DECISION R3).
        initialize_ticks: length of Initialize (DECISION R6).
        power_on_ticks: from the power button to the result (DECISION R6).
        power_on_timeout_ticks: from the power button to `PowerOnTimeout` (DECISION R6).
        button_off_ticks: from the power button to `PowerOffFinished` (DECISION R6).
        forced_off_ticks: the same after a forced stop (DECISION R6).
        fault_hold_ticks: how long a fault must last to be detected (DECISION R25).
        buffer_bytes: size of the receive buffer (DECISION R27).
        overtime: whether too much work stops VR2 (DECISION R27).

    Raises:
        ValueError: a time or size below 1, or an event name the manual does not know.
    """

    device_name: str = "RRC"
    version: str = "Version 1.0"
    date: str = "Apr 30 2015 00:00:00"
    power_on_event: str = POWER_ON_TRIGGER
    power_on_fail_target: FailTarget = FailTarget.WAIT
    initialize_ticks: int = 1
    power_on_ticks: int = 30
    power_on_timeout_ticks: int = 300
    button_off_ticks: int = 50
    forced_off_ticks: int = 10
    fault_hold_ticks: int = 10
    buffer_bytes: int = 256
    overtime: bool = True

    def __post_init__(self) -> None:
        """Refuse what no RRC could be."""
        names = (POWER_ON_TRIGGER, RrcEvent.POWER_ON.value)
        if self.power_on_event not in names:
            raise ValueError(f"power-on event {self.power_on_event!r} is none of {names}")
        for name in (
            *("initialize_ticks", "power_on_ticks", "power_on_timeout_ticks"),
            *("button_off_ticks", "forced_off_ticks", "fault_hold_ticks", "buffer_bytes"),
        ):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}, at least 1 is needed")
