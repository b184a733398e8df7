"""Physical effects that a command may have, as a sentence, or an empty text if nothing moves."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tickrig.host.canmon.model.decode.node_memory import Entry
from tickrig.wire.canopen.nmt import NmtCommand

_DRIVE_AREA: Final = range(0x6000, 0xA000)
"""Objects of the device profiles. CiA 402 has objects for eight axes at a distance of 800h."""
_AXIS: Final = 0x800
_COMMANDS: Final = {
    0x40: "controlword",
    0x42: "target velocity of vl mode",
    0x5A: "quick stop option",
    0x60: "mode of operation",
    0x71: "target torque",
    0x7A: "target position",
    0x98: "homing method",
    0xC1: "interpolated position",
    0xFF: "target velocity",
}
"""Objects that may turn a motor, by the low part of the index (CiA 402-2)."""
_MANUFACTURER: Final = range(0x2000, 0x6000)
_DRIVE_PROFILE: Final = 402
_IO_PROFILE: Final = 401
_SEVERAL: Final = 0xFFFF

NMT_WORDS: Final = {
    "start": NmtCommand.START,
    "stop": NmtCommand.STOP,
    "pre-op": NmtCommand.ENTER_PRE_OPERATIONAL,
    "reset-node": NmtCommand.RESET_NODE,
    "reset-comm": NmtCommand.RESET_COMMUNICATION,
}
"""NMT commands with the names that `canmon net nmt` and the screen use."""


def write_risk(is_drive: bool, entries: Iterable[Entry]) -> str:
    """Return a warning about motion that a write to objects of a node may cause, or an empty text.

    The text depends on the objects, and on whether the node is a CiA 402 drive.
    """
    indices = [index for index, _ in entries]
    profile = [index for index in indices if index in _DRIVE_AREA]
    told = [name for index in profile if (name := _COMMANDS.get((index - 0x6000) % _AXIS))]
    if told and is_drive:
        return f"This may turn a motor: {', '.join(dict.fromkeys(told))}"
    if profile:
        return f"This may move what the node drives: {_listed(profile)} is of its device profile"
    maker = [index for index in indices if index in _MANUFACTURER]
    if maker:
        return f"What {_listed(maker)} does its maker knows; it may move something"
    return ""


def nmt_risk(command: NmtCommand, device_type: int | None) -> str:
    """Return a warning about the motion or output change that an NMT command may cause at a node.

    Args:
        command: NMT command.
        device_type: device type (object 1000h) of the node, or None if unknown.
    """
    profile = _SEVERAL if device_type is None else device_type & 0xFFFF
    may_turn = profile in (_DRIVE_PROFILE, _SEVERAL)
    if command is NmtCommand.START:
        if may_turn:
            return "This may turn a motor: a drive that is Operational obeys RPDOs"
        return "Outputs may switch: a node that is Operational obeys RPDOs"
    if command is NmtCommand.ENTER_PRE_OPERATIONAL:
        return "It obeys RPDOs no more: what moves may go on as it is"
    if may_turn:
        return "A drive may release its motor: a suspended load may fall"
    return "Its outputs may switch to their error values"


def _listed(indices: Iterable[int]) -> str:
    return ", ".join(f"{index:04X}h" for index in dict.fromkeys(indices))
