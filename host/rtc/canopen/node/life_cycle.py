"""Scripts for the operations on a proxy (ours: section 4.3 of the digest, K14, K21)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.dialogue import AwaitState, Command, Pause, Script
from tickrig.host.canopen.errors import SdoFailed, StateTimeout
from tickrig.host.canopen.sdo_transfer import download_number, upload_number
from tickrig.host.rtc.canopen.definition.definition import NodeEntry, Role
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

CONFIRM_US: Final = 300_000
"""The least time in which a device has to report the state that was asked for."""

CONTROLWORD: Final = 0x6040
STATUSWORD: Final = 0x6041
FAULT_RESET: Final = 0x80
LOOK_US: Final = 10_000
"""How often the statusword is looked at."""

STATE_BITS: Final = 0x6F
ENABLING: Final = ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27))
DISABLING: Final = ((0x07, 0x23), (0x06, 0x21))
"""Controlword, and the bits of the statusword that confirm it (CiA 402-2)."""


def confirm_us(entry: NodeEntry) -> int:
    """Return the time in which a node has to confirm (K14)."""
    return max(3_000 * entry.heartbeat_ms, CONFIRM_US)


@dataclass(frozen=True, slots=True)
class LifeCycleScripts:
    """What is said to a node for each operation on its proxy."""

    activate: Callable[[NodeEntry], Script[None]]
    deactivate: Callable[[NodeEntry], Script[None]]
    reset: Callable[[NodeEntry], Script[None]]


def _to(command: NmtCommand, state: NmtState) -> Callable[[NodeEntry], Script[None]]:
    def move(entry: NodeEntry) -> Script[None]:
        yield Command(command)
        yield AwaitState(state, confirm_us(entry))

    return move


start: Final = _to(NmtCommand.START, NmtState.OPERATIONAL)
enter_pre_operational: Final = _to(NmtCommand.ENTER_PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL)
reset_node: Final = _to(NmtCommand.RESET_NODE, NmtState.INITIALISING)


def _enable(entry: NodeEntry) -> Script[None]:
    yield from start(entry)
    yield from _control(entry, ENABLING)


def _disable(entry: NodeEntry) -> Script[None]:
    yield from _control(entry, DISABLING)
    yield from enter_pre_operational(entry)


def _reset_drive(entry: NodeEntry) -> Script[None]:
    """Reset the fault, which takes SDO, so not Stopped; then the node, come of it what may."""
    try:
        yield from enter_pre_operational(entry)
        yield from download_number(CONTROLWORD, 0, 0, 2)
        yield from download_number(CONTROLWORD, 0, FAULT_RESET, 2)
        yield Pause(LOOK_US)
    except (SdoFailed, StateTimeout):
        pass
    yield from reset_node(entry)


def _control(entry: NodeEntry, words: tuple[tuple[int, int], ...]) -> Script[None]:
    """Write controlwords, each when the statusword has confirmed the one before."""
    for controlword, wanted in words:
        yield from download_number(CONTROLWORD, 0, controlword, 2)
        for _ in range(confirm_us(entry) // LOOK_US):
            statusword = yield from upload_number(STATUSWORD, 0)
            if statusword & STATE_BITS == wanted:
                break
            yield Pause(LOOK_US)
        else:
            raise StateTimeout(f"statusword {statusword:04X}h after controlword {controlword:04X}h")


_PLAIN: Final = LifeCycleScripts(start, enter_pre_operational, reset_node)

LIFE_CYCLES: Final[Mapping[Role, LifeCycleScripts]] = {
    Role.DEVICE_RTC: _PLAIN,
    Role.DEVICE: _PLAIN,
    Role.DRIVE: LifeCycleScripts(_enable, _disable, _reset_drive),
}
