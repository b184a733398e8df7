"""Faults of one CANopen node, by name: a filter between the slave and its end of the bus."""

# Theory of operation.
#
# Most faults of a node are visible in its frames: an answer is late, a heartbeat is missing, a PDO
# is too short. So each fault is an entry of `NODE_FAULTS`. The entry names the frames that the
# fault acts on (`_NodeFrames`). It also has a function that returns the frames sent or received
# instead, each with its delay. The slave is not involved, like a real slave with such a fault.
#
#   Station -> FaultyNode -> (TracedDevice) -> Node -> slave         port: CanEnd -> CanWire
#                  |  rx: SYNC, SDO requests are lost or answered here
#                  |  tx: SDO answers, heartbeats, boot-up, PDOs are changed, late, doubled, lost
#
# An operator arms faults at `NodeFaults`. A `_FaultyNode` is inserted between the station and its
# device (`Station.device`) only while a fault is armed or a late frame waits. So a node without
# faults takes no additional time. A trace records the device itself, so a replay needs no faults.
#
# Three kinds of faults act in another way:
#   - Faults that act `by_itself` send frames, or restart the node, at their own times.
#   - `bus_off` acts on the CAN controller (`CanWire.force_off`).
#   - `NARROWED` are faults of the bus, limited to the frames of this node.
#
# Some frames of a block transfer look like other frames. `_SdoBlocks` follows the block transfer,
# so that a segment is not mistaken for a request. Times are those of the ticks, and random numbers
# come from the bus. So a fault is the same in each run, dense or sparse, in forks and after
# snapshots.

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Flag, auto
from functools import partial
from heapq import heappop, heappush
from typing import Any, Final

from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.device.twin import Copyable, Listeners
from tickrig.emulators.can.faults import CAN_FAULTS, NARROWED
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.record.recorder import DeviceBefore
from tickrig.emulators.rig.faults import (
    FaultArgument,
    FaultArguments,
    FaultForm,
    FaultTally,
    FaultTrigger,
    bind_arguments,
)
from tickrig.emulators.rig.station import Station
from tickrig.host.text.trace import Mark
from tickrig.wire.can import CanFrame, Frames, data_frame
from tickrig.wire.canopen import sdo_frame
from tickrig.wire.canopen.emcy import ErrorRegister
from tickrig.wire.canopen.nmt import CAN_ID_MASK, ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER

# Kinds of frames.

_EMCY_COB_ID: Final = 0x080
_SYNC_COB_ID: Final = 0x080
_LSS_ANSWER: Final = 0x7E4
_TIME_COB_ID: Final = 0x100
_MAX_DATA: Final = 8
_BIT_US: Final = 1_000_000
_SHORTEST_BITS: Final = 47
"""Number of bits of a frame without data, including the bits up to the next frame."""


class _NodeFrames(Flag):
    """Kinds of frames from and to a node."""

    OTHER = auto()
    BOOT_UP = auto()
    HEARTBEAT = auto()
    PDO = auto()
    SDO_INDEX = auto()
    SDO_SEGMENT = auto()
    SDO_END = auto()
    SDO_REST = auto()
    FOR_SDO = auto()
    FOR_SDO_START = auto()
    FOR_SDO_END = auto()
    SYNC = auto()

    SDO = SDO_INDEX | SDO_SEGMENT | SDO_END | SDO_REST
    SENT = OTHER | BOOT_UP | HEARTBEAT | PDO | SDO
    REQUEST = FOR_SDO | FOR_SDO_START | FOR_SDO_END


_NO_FRAMES: Final = _NodeFrames(0)


_ANSWERS: Final = {
    int(sdo_frame.ServerCommand.UPLOAD): _NodeFrames.SDO_INDEX,
    int(sdo_frame.ServerCommand.DOWNLOAD): _NodeFrames.SDO_INDEX,
    int(sdo_frame.ServerCommand.BLOCK_UPLOAD): _NodeFrames.SDO_INDEX,
    int(sdo_frame.ServerCommand.UPLOAD_SEGMENT): _NodeFrames.SDO_SEGMENT,
    int(sdo_frame.ServerCommand.DOWNLOAD_SEGMENT): _NodeFrames.SDO_SEGMENT,
    0xE0: _NodeFrames.SDO_REST,  # no service has it
    0x80: _NodeFrames.SDO_REST,
}


class _SdoBlocks(Copyable):
    """Follows the block transfers of an SDO server, in which any byte may begin a frame."""

    __slots__ = ("_last", "_of_client", "_of_server")

    def __init__(self) -> None:
        self._of_client = self._of_server = False  # whose segments are under way
        self._last = 0  # sequence number of the last segment of all, if it has passed

    def received(self, data: bytes) -> _NodeFrames:
        """Return the kind of a request."""
        first = data[0] if data else sdo_frame.ClientCommand.ABORT
        specifier = first & sdo_frame.SPECIFIER
        if self._of_client and first != sdo_frame.ClientCommand.ABORT:
            self._pass(first)
            return _NodeFrames.FOR_SDO
        if first in (sdo_frame.BLOCK_START, sdo_frame.BLOCK_ACKNOWLEDGE):
            ended = self._last and len(data) > 1 and data[1] == self._last
            self._of_server, self._last = not ended, 0
            return _NodeFrames.FOR_SDO
        self._of_client = self._of_server = False
        if specifier == sdo_frame.ClientCommand.BLOCK_DOWNLOAD and first & 1:
            return _NodeFrames.FOR_SDO_END
        starts = (
            specifier in (sdo_frame.ClientCommand.DOWNLOAD, sdo_frame.ClientCommand.UPLOAD)
            or specifier == sdo_frame.ClientCommand.BLOCK_DOWNLOAD
            or (specifier == sdo_frame.ClientCommand.BLOCK_UPLOAD and not first & 3)
        )
        return _NodeFrames.FOR_SDO_START if starts else _NodeFrames.FOR_SDO

    def sent(self, data: bytes) -> _NodeFrames:
        """Return the kind of an answer."""
        first = data[0] if data else sdo_frame.ServerCommand.ABORT
        if first == sdo_frame.ServerCommand.ABORT:
            self._of_client = self._of_server = False
            return _NodeFrames.SDO_REST
        if self._of_server:
            self._pass(first)
            return _NodeFrames.SDO_REST
        specifier = first & sdo_frame.SPECIFIER
        if specifier == sdo_frame.ServerCommand.BLOCK_UPLOAD and first & 1:
            return _NodeFrames.SDO_END
        if specifier != sdo_frame.ServerCommand.BLOCK_DOWNLOAD:
            return _ANSWERS[specifier]
        if not first & sdo_frame.BLOCK_SUBCOMMAND:  # a download by blocks begins
            self._of_client, self._last = True, 0
            return _NodeFrames.SDO_INDEX
        if first == sdo_frame.BLOCK_ACKNOWLEDGE:
            ended = self._last and len(data) > 1 and data[1] == self._last
            self._of_client, self._last = not ended, 0
        return _NodeFrames.SDO_REST

    def _pass(self, first: int) -> None:
        if first & sdo_frame.BLOCK_LAST:
            self._last = first & sdo_frame.BLOCK_SEQNO


# How faults are declared.

_Sent = tuple[tuple[int, CanFrame], ...]
"""The frames that are sent instead of a frame, each with its delay in us."""


class _ArmedNodeFault(Copyable):
    """An armed fault of a node.

    Attributes:
        fault_type: declaration of the fault.
        arguments: arguments of the arming.
        trigger: trigger that decides when the fault acts.
        kept: stored data by CAN-ID.
        next_us: time of the next action that the fault takes by itself, or 0 for at once.
    """

    __slots__ = ("arguments", "fault_type", "kept", "next_us", "trigger")

    def __init__(
        self, fault_type: _NodeFaultType, arguments: FaultArguments, trigger: FaultTrigger
    ) -> None:
        self.fault_type, self.arguments, self.trigger = fault_type, arguments, trigger
        self.kept: dict[int, bytes] = {}
        self.next_us = 0 if fault_type.by_itself else NEVER

    def __getitem__(self, name: str) -> Any:
        """Return an argument."""
        return self.arguments[name]


def _lost(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return ()


@dataclass(frozen=True, slots=True)
class _NodeFaultType(FaultForm):
    """A fault of a node that can be armed by name.

    Attributes:
        frames: the kind of frames that the fault acts on.
        instead: function that returns the frames sent instead of a frame.
        matches: function that returns whether the fault acts on a frame of that kind.
        by_itself: action that the fault takes in each `period` (an argument), or in each tick if it
            has no such argument.
        abort: function that returns the frame with which the fault itself answers the request.
        controller: function that acts on the CAN controller.
        silent: whether the node neither sends nor receives until the held frame has been sent.
        in_order: whether later SDO answers wait until the held answer has been sent.
        boots: whether the second node sends a boot-up first.
    """

    frames: _NodeFrames = field(default=_NO_FRAMES, kw_only=True)
    instead: Callable[[_ArmedNodeFault, CanFrame], _Sent] = field(default=_lost, kw_only=True)
    matches: Callable[[NodeFaults, _ArmedNodeFault, CanFrame], bool] | None = field(
        default=None, kw_only=True
    )
    by_itself: Callable[[NodeFaults, _ArmedNodeFault], Frames] | None = field(
        default=None, kw_only=True
    )
    abort: Callable[[NodeFaults, _ArmedNodeFault, CanFrame], CanFrame] | None = field(
        default=None, kw_only=True
    )
    controller: bool = field(default=False, kw_only=True)
    silent: bool = field(default=False, kw_only=True)
    in_order: bool = field(default=False, kw_only=True)
    boots: bool = field(default=False, kw_only=True)


# Effect of each fault on a frame.


def _late(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return ((fault["delay"], frame),)


def _again(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return ((0, frame), (fault["delay"], frame))


def _with(frame: CanFrame, data: bytes) -> _Sent:
    return ((0, data_frame(frame.can_id, data)),)


def _other_index(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    index = (int.from_bytes(frame.data[1:3], "little") + fault["by"]) & 0xFFFF
    return _with(frame, frame.data[:1] + index.to_bytes(2, "little") + frame.data[3:])


def _other_toggle(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return _with(frame, bytes([frame.data[0] ^ sdo_frame.TOGGLE]) + frame.data[1:])


def _other_crc(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    turned = bytes(byte ^ 0xFF for byte in frame.data[1:3])
    return _with(frame, frame.data[:1] + turned + frame.data[3:])


def _other_state(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return _with(frame, bytes([NmtState[fault["state"].upper()]]))


def _shorter(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return _with(frame, frame.data[: max(0, len(frame.data) - fault["bytes"])])


def _longer(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return _with(frame, (frame.data + bytes(fault["bytes"]))[:_MAX_DATA])


def _stale(fault: _ArmedNodeFault, frame: CanFrame) -> _Sent:
    return _with(frame, fault.kept.setdefault(frame.can_id, frame.data))


# Arguments that select an object or a PDO.


@dataclass(frozen=True, slots=True)
class _Target:
    """Objects whose transfers are aborted, and the abort code.

    Attributes:
        index: index of the objects, or None for all objects.
        sub: sub-index of the objects, or None for all sub-indices.
        code: abort code.
    """

    index: int | None
    sub: int | None
    code: int | None


def _parse_target(word: str) -> _Target:
    """Read `any`, `6081h`, `6081h:0`, `6081h:0x06090030`, `6081h:0:0x06090030`, `0x06090030`.

    >>> _parse_target("6081h:0x06090030")
    _Target(index=24705, sub=None, code=101253168)
    """
    *parts, last = word.split(":")
    code = None
    if (number := _number(last)) is not None and number > 0xFFFF:
        code = number
    else:
        parts.append(last)
    index = sub = None
    numbers = [_number(part) for part in parts]
    if parts and parts != ["any"]:
        index, sub = (*numbers, None)[:2]
    wrong = parts != ["any"] and None in numbers
    if wrong or len(parts) > 2 or max(index or 0, 0) > 0xFFFF or (sub or 0) > 0xFF:
        form = "INDEX[:SUB][:CODE], any or CODE"
        raise ValueError(f"{word!r} is not {form}, as 6081h:0x06090030")
    if code is not None and code > 0xFFFF_FFFF:
        raise ValueError(f"abort code {last} has more than 32 bits")
    return _Target(index, sub, code)


def _number(word: str) -> int | None:
    """Read a number in CiA notation (`8110h`) or Python notation; return None if invalid."""
    try:
        return int(word[:-1], 16) if word[-1:] in ("h", "H") else int(word, 0)
    except ValueError:
        return None


def _parse_hex(low: int, high: int, what: str, word: str) -> int:
    number = _number(word)
    if number is None or not low <= number <= high:
        raise ValueError(f"{word!r} is not {what}, {low:X}h to {high:X}h")
    return number


def _parse_tpdo(word: str) -> int | None:
    number = _number(word)
    if word != "any" and (number is None or not 1 <= number <= 512):
        raise ValueError(f"tpdo {word!r} is not any or a number 1 to 512")
    return number


_READS: Final = (sdo_frame.ClientCommand.UPLOAD, sdo_frame.ClientCommand.BLOCK_UPLOAD)


def _is_object(faults: NodeFaults, fault: _ArmedNodeFault, frame: CanFrame) -> bool:
    """Return whether a request starts a transfer to be aborted."""
    target, access = fault["object"], fault["access"]
    reads = frame.data[0] & sdo_frame.SPECIFIER in _READS
    if access not in ("both", "read" if reads else "write"):
        return False
    index, sub = sdo_frame.index_sub(frame.data)
    return target.index in (None, index) and target.sub in (None, sub)


def _is_tpdo(faults: NodeFaults, fault: _ArmedNodeFault, frame: CanFrame) -> bool:
    number = fault["tpdo"]
    return number is None or faults.cob_id(0x1800 + number - 1, 1, -1) == frame.can_id


def _aborted(faults: NodeFaults, fault: _ArmedNodeFault, frame: CanFrame) -> CanFrame:
    target = fault.arguments.values.get("object")
    code = fault.arguments.values.get("code") if target is None else target.code
    code = int(sdo_frame.AbortCode.GENERAL) if code is None else code
    index, sub = sdo_frame.index_sub(frame.data)
    data = sdo_frame.frame_at(sdo_frame.ServerCommand.ABORT, index, sub, code.to_bytes(4, "little"))
    return data_frame(faults.sdo_answer_id, data)


# Own actions of some faults.


def _restarted(faults: NodeFaults, fault: _ArmedNodeFault) -> Frames:
    faults.restart()
    return ()


def _emergencies(faults: NodeFaults, fault: _ArmedNodeFault) -> Frames:
    code = fault["code"]
    register = ErrorRegister.GENERIC | (ErrorRegister.COMMUNICATION if code >> 12 == 8 else 0)
    data = code.to_bytes(2, "little") + bytes([register]) + bytes(5)
    return (data_frame(faults.emcy_id, data),)


def _babbles(faults: NodeFaults, fault: _ArmedNodeFault) -> Frames:
    """Fill the queue for a tick with frames of the node's highest priority."""
    wanted = faults.node.tick_us * faults.wire.bit_rate // (_BIT_US * _SHORTEST_BITS) + 1
    return (data_frame(faults.emcy_id, b""),) * max(0, wanted - faults.node.port.waiting)


# The faults.


def _time(name: str, default: str, text: str) -> FaultArgument:
    return FaultArgument(name, text, default, "time", 1_000, 3_600_000_000)


def _code(text: str, default: str, low: int, high: int) -> FaultArgument:
    read = partial(_parse_hex, low, high, f"an {text}")
    return FaultArgument("code", text, default, f"{low:X}h to {high:X}h", read=read)


def _on(
    frames: _NodeFrames,
    text: str,
    instead: Callable[[_ArmedNodeFault, CanFrame], _Sent] = _lost,
    *arguments: FaultArgument,
    **more: Any,
) -> _NodeFaultType:
    """Return a fault that acts on frames, or on frames of one TPDO with the argument `tpdo`."""
    if _TPDO in arguments:
        more["matches"] = _is_tpdo
    return _NodeFaultType(text, arguments=arguments, frames=frames, instead=instead, **more)


_TPDO: Final = FaultArgument("tpdo", "which TPDO", "any", "any or 1 to 512", read=_parse_tpdo)
_BYTES: Final = FaultArgument("bytes", "how many", "1", "bytes", 1, 8)
_STATE: Final = FaultArgument(
    "state",
    "which one",
    "stopped",
    choices=("stopped", "operational", "pre_operational", "initialising"),
)
_OBJECT: Final = FaultArgument(
    "object",
    "which object, and the abort code (08000000h without one)",
    "any",
    "INDEX[:SUB][:CODE], any or CODE",
    read=_parse_target,
)
_ACCESSES: Final = ("both", "read", "write")


def _parse_access(word: str) -> str:
    if word in _ACCESSES:
        return word
    hint = "" if _number(word) is None else f"; an abort code follows a colon: 6040h:{word}"
    raise ValueError(f"access {word!r} is not {' or '.join(_ACCESSES)}{hint}")


_ACCESS: Final = FaultArgument(
    "access", "which transfers", "both", " or ".join(_ACCESSES), read=_parse_access
)

NODE_FAULTS: Final[Mapping[str, _NodeFaultType]] = {
    "sdo_abort": _on(
        _NodeFrames.FOR_SDO_START,
        "the SDO server aborts transfers of an object, or of all",
        _lost,
        _OBJECT,
        _ACCESS,
        matches=_is_object,
        abort=_aborted,
    ),
    "sdo_busy": _on(
        _NodeFrames.FOR_SDO_START,
        "the SDO server refuses each new transfer: it has no connection free",
        _lost,
        _code("abort code", "0x060A0023", 0x1_0000, 0xFFFF_FFFF),
        abort=_aborted,
    ),
    "sdo_mute": _on(_NodeFrames.REQUEST, "the SDO server ignores requests"),
    "sdo_slow": _on(
        _NodeFrames.SDO,
        "each SDO answer is late",
        _late,
        _time("delay", "800ms", "how much later it comes"),
        in_order=True,
    ),
    "sdo_twice": _on(
        _NodeFrames.SDO,
        "each SDO answer comes twice",
        _again,
        _time("delay", "1ms", "how much later it comes again"),
    ),
    "sdo_wrong_index": _on(
        _NodeFrames.SDO_INDEX,
        "SDO answers name another object",
        _other_index,
        FaultArgument("by", "what is added to the index", "1", low=1, high=0xFFFF),
    ),
    "sdo_toggle": _on(
        _NodeFrames.SDO_SEGMENT, "SDO segments have the wrong toggle bit", _other_toggle
    ),
    "sdo_crc": _on(
        _NodeFrames.SDO_END | _NodeFrames.FOR_SDO_END,
        "the CRC at the end of a block transfer is wrong, either way",
        _other_crc,
    ),
    "heartbeat_mute": _on(_NodeFrames.HEARTBEAT, "heartbeats are missing"),
    "heartbeat_state": _on(
        _NodeFrames.HEARTBEAT, "heartbeats report another state", _other_state, _STATE
    ),
    "heartbeat_late": _on(
        _NodeFrames.HEARTBEAT,
        "heartbeats come late",
        _late,
        _time("delay", "1s", "how much later they come"),
    ),
    "boot_late": _on(
        _NodeFrames.BOOT_UP,
        "the node starts slowly: until its boot-up it neither sends nor receives",
        _late,
        _time("delay", "3s", "how much later it boots"),
        silent=True,
    ),
    "boots_twice": _on(
        _NodeFrames.BOOT_UP,
        "each boot-up comes twice",
        _again,
        _time("delay", "10ms", "how much later it comes again"),
    ),
    "boots_again": _NodeFaultType(
        "the node restarts by itself, at once and then each period",
        arguments=(_time("period", "5s", "from one to the next"),),
        by_itself=_restarted,
    ),
    "pdo_short": _on(_NodeFrames.PDO, "TPDOs have bytes too few", _shorter, _BYTES, _TPDO),
    "pdo_long": _on(_NodeFrames.PDO, "TPDOs have bytes too many, up to 8", _longer, _BYTES, _TPDO),
    "pdo_mute": _on(_NodeFrames.PDO, "TPDOs are missing", _lost, _TPDO),
    "pdo_stale": _on(
        _NodeFrames.PDO,
        "TPDOs repeat the data of the first one since the fault began",
        _stale,
        _TPDO,
    ),
    "emcy_storm": _NodeFaultType(
        "an EMCY is sent over and over",
        arguments=(
            _code("emergency error code", "0x8110", 0, 0xFFFF),
            _time("period", "10ms", "from one to the next"),
        ),
        by_itself=_emergencies,
    ),
    "id_doubled": _on(
        _NodeFrames.SENT,
        "a second node has this node-ID: it boots, and sends each frame too",
        _again,
        _time("delay", "1ms", "how much later it sends"),
        boots=True,
    ),
    "sync_lost": _on(_NodeFrames.SYNC, "the node receives no SYNC"),
    "bus_off": _NodeFaultType(
        "its CAN controller is bus-off, and does not come back until the fault ends",
        rated=False,
        controller=True,
    ),
    "babble": _NodeFaultType(
        "the node sends frames on its EMCY CAN-ID without a pause", by_itself=_babbles
    ),
}


class NodeFaults(Copyable):
    """The faults of one CANopen node, which an operator switches on ("arms") by name.

    Args:
        node: the node.
        wire: bus of the node. It supplies the random numbers for the faults. Some of the faults are
            faults of this bus that hit only frames of the node.

    Attributes:
        station: the station of the node, as soon as the node has one.
        listeners: functions that are called when faults have changed frames. The four arguments are
            the time, the direction of the frames, the frames as they were sent, and the frames that
            are left after the faults. A copy of the node (a twin) has no listeners.
    """

    fault_types: Mapping[str, FaultForm] = {
        **{name: CAN_FAULTS[name] for name in NARROWED},
        **NODE_FAULTS,
    }

    def __init__(self, node: Node, wire: CanWire) -> None:
        self.node, self.wire = node, wire
        self.station: Station[Frames] | None = None
        self._armed: dict[str, _ArmedNodeFault] = {}
        self._tallies: dict[str, FaultTally] = {}
        self._narrowed: tuple[str, ...] = ()
        self._blocks = _SdoBlocks()
        self._held: list[tuple[int, int, CanFrame]] = []  # a heap: when, which one, the frame
        self._count, self._silent_us, self._now_us = 0, 0, 0
        self._answer_us = 0  # before this time the SDO server sends no further answer
        self.listeners: Listeners[Callable[[int, Mark, Frames, Frames], None]] = Listeners()

    @property
    def armed(self) -> tuple[str, ...]:
        """Names of the faults that are armed."""
        return (*self._narrowed, *self._armed)

    def check(self, name: str, *arguments: str) -> None:
        """Raise ValueError unless the fault can be armed with these arguments."""
        bind_arguments(name, self.fault_types[name], arguments)

    def arm(self, name: str, *arguments: str) -> None:
        """Switch on a fault of the node. It replaces a fault of the same name.

        Raises:
            KeyError: no fault has this name.
            ValueError: an argument is unknown, or a value is out of range.
        """
        self.clear(name)
        if name in NARROWED:
            self.wire.faults.arm(name, *arguments, number=self.node.port.number)
            self._narrowed += (name,)
            return
        fault_type = NODE_FAULTS[name]
        bound = bind_arguments(name, fault_type, arguments)
        tally = self._tallies[name] = FaultTally(bound.count)
        chance = self.wire.faults.chance(f"{self.node.name} {name}")
        armed = _ArmedNodeFault(fault_type, bound, FaultTrigger(chance, bound, tally))
        self._armed[name] = armed
        if fault_type.controller:
            tally.allow()
            self.wire.force_off(self.node.port)
        if fault_type.boots and self.node.is_on:
            self._hold(0, data_frame(self._error_control_id, bytes([NmtState.INITIALISING])))
        if self.station is not None and not isinstance(self.station.device, _FaultyNode):
            self.station.device = _FaultyNode(self.station.device, self)

    def clear(self, name: str) -> None:
        """Switch off a fault of the node; do nothing if it is not on.

        Frames that were delayed by faults are sent now.
        """
        if name in self._narrowed:
            self.wire.faults.clear(name, self.node.port.number)
            self._narrowed = tuple(each for each in self._narrowed if each != name)
            return
        armed = self._armed.pop(name, None)
        if armed is None:
            return
        if armed.fault_type.controller:
            self.wire.release(self.node.port)
        if armed.fault_type.silent:
            self._silent_us = 0
        self._held = [(0, count, frame) for _, count, frame in sorted(self._held)]
        self._answer_us = 0

    def acted(self, name: str) -> int:
        """Return how often a fault has acted since it was last armed."""
        if name in NARROWED:
            return self.wire.faults.acted(name, self.node.port.number)
        return self._tallies[name].acted if name in self._tallies else 0

    @property
    def due_us(self) -> int:
        """Time at which a periodic fault acts next, or a delayed frame is sent."""
        due_us = self._held[0][0] if self._held else NEVER
        return min([due_us, *(armed.next_us for armed in self._armed.values())])

    @property
    def idle(self) -> bool:
        """Whether nothing is armed or held."""
        return not (self._armed or self._held)

    def cob_id(self, index: int, sub: int, otherwise: int) -> int:
        """Return the CAN-ID that an object of the node contains.

        Args:
            index: index of the object, such as 1014h for the EMCY.
            sub: sub-index of the object.
            otherwise: CAN-ID to return if there is no such object, and before the boot-up, when the
                objects do not have their values yet.
        """
        slave = self.node.slave
        entry = slave.dictionary.find(index, sub)
        if entry is None or slave.state is NmtState.INITIALISING:
            return otherwise
        return entry.number & CAN_ID_MASK

    @property
    def sdo_answer_id(self) -> int:
        """CAN-ID of the answers of the SDO server."""
        return self.cob_id(0x1200, 2, sdo_frame.RESPONSE_COB_ID + self.node.slave.node_id)

    @property
    def emcy_id(self) -> int:
        """CAN-ID of the EMCY."""
        return self.cob_id(0x1014, 0, _EMCY_COB_ID + self.node.slave.node_id)

    @property
    def _error_control_id(self) -> int:
        return ERROR_CONTROL_COB_ID + self.node.slave.node_id

    def restart(self) -> None:
        """Restart the node."""
        if self.station is not None:
            self.station.device.reset()

    def before(self, now_us: int, received: Frames) -> tuple[Frames, Frames]:
        """Apply the faults to the frames that the node receives in a tick.

        Args:
            now_us: time of the tick.
            received: frames that have arrived.

        Returns:
            Two sequences: the frames that the node receives, and the frames that the faults send on
            the bus.
        """
        self._now_us = now_us
        if not self.node.is_on:
            self._held.clear()
            self._answer_us = 0
            return received, ()
        left, sent = list[CanFrame](), list[CanFrame]()
        for frame in received:
            left += self._receive(frame, sent)
        for armed in tuple(self._armed.values()):
            act = armed.fault_type.by_itself
            if act is not None and armed.next_us <= now_us:
                period_us = armed.arguments.values.get("period", self.node.tick_us)
                armed.next_us = (armed.next_us or now_us) + period_us
                named = self.node.slave.node_id != UNCONFIGURED
                if named and armed.trigger.hit():
                    sent += act(self, armed)
        return tuple(left), tuple(sent)

    def after(self, now_us: int, sent: Frames) -> Frames:
        """Apply the faults to the frames that the node sends in a tick.

        Args:
            now_us: time of the tick.
            sent: frames from the node.

        Returns:
            The frames to send, with delayed frames of earlier ticks.
        """
        left = self._released(now_us - 1)
        for frame in sent:
            left += self._send(frame)
        return (*left, *self._released(now_us))

    def _released(self, until_us: int) -> list[CanFrame]:
        """Take the delayed frames that are due, in order."""
        due = list[CanFrame]()
        while self._held and self._held[0][0] <= until_us:
            due.append(heappop(self._held)[2])
        return due

    def _receive(self, frame: CanFrame, sent: list[CanFrame]) -> Frames:
        kind = self._kind_of_received(frame)
        if self._now_us < self._silent_us:
            return self._hear(Mark.TO_DEVICE, frame, ())
        left: Frames = (frame,)
        for armed in self._acting_on(kind, frame):
            if armed.fault_type.abort is not None:
                sent.append(armed.fault_type.abort(self, armed, frame))
                return self._hear(Mark.TO_DEVICE, frame, ())
            left = tuple(f for each in left for _, f in armed.fault_type.instead(armed, each))
        return self._hear(Mark.TO_DEVICE, frame, left)

    def _send(self, frame: CanFrame) -> Frames:
        kind = self._kind_of_sent(frame)
        if self._now_us < self._silent_us and kind is not _NodeFrames.BOOT_UP:
            return self._hear(Mark.FROM_DEVICE, frame, ())
        coming: _Sent = ((0, frame),)
        for armed in self._acting_on(kind, frame):
            coming = tuple(
                (before_us + after_us, each)
                for before_us, first in coming
                for after_us, each in armed.fault_type.instead(armed, first)
            )
            if armed.fault_type.silent:
                self._silent_us = self._now_us + armed["delay"]
            if armed.fault_type.in_order:
                self._answer_us = max(self._answer_us, self._now_us + armed["delay"])
        # A server answers one request after the other: no answer overtakes a late one.
        waits = bool(kind & _NodeFrames.SDO) and self._answer_us >= self._now_us > 0
        first_us = self._answer_us - self._now_us if waits else 0
        for late_us, each in coming:
            if late_us or waits:
                self._hold(self._now_us + max(late_us, first_us), each)
        at_once = tuple(each for late_us, each in coming if not (late_us or waits))
        return self._hear(Mark.FROM_DEVICE, frame, at_once)

    def _acting_on(self, kind: _NodeFrames, frame: CanFrame) -> list[_ArmedNodeFault]:
        return [
            armed
            for armed in self._armed.values()
            if kind & armed.fault_type.frames
            and (armed.fault_type.matches is None or armed.fault_type.matches(self, armed, frame))
            and armed.trigger.hit()
        ]

    def _hold(self, at_us: int, frame: CanFrame) -> None:
        self._count += 1
        heappush(self._held, (at_us, self._count, frame))

    def _hear(self, mark: Mark, frame: CanFrame, left: Frames) -> Frames:
        if left != (frame,):
            for hear in self.listeners:
                hear(self._now_us, mark, (frame,), left)
        return left

    def _kind_of_received(self, frame: CanFrame) -> _NodeFrames:
        deaf = self.node.slave.state is NmtState.INITIALISING  # it uses up no fault
        if deaf or frame.remote or frame.extended:
            return _NO_FRAMES
        request_id = sdo_frame.REQUEST_COB_ID + self.node.slave.node_id
        if frame.can_id == self.cob_id(0x1200, 1, request_id):
            whole = len(frame.data) == sdo_frame.FRAME_BYTES
            return self._blocks.received(frame.data) if whole else _NodeFrames.FOR_SDO
        sync = frame.can_id == self.cob_id(0x1005, 0, _SYNC_COB_ID)
        return _NodeFrames.SYNC if sync else _NO_FRAMES

    def _kind_of_sent(self, frame: CanFrame) -> _NodeFrames:
        can_id = frame.can_id
        if frame.remote or frame.extended:
            return _NodeFrames.OTHER
        if can_id == self._error_control_id:
            boots = frame.data == bytes([NmtState.INITIALISING])
            return _NodeFrames.BOOT_UP if boots else _NodeFrames.HEARTBEAT
        if can_id == self.sdo_answer_id:
            return self._blocks.sent(frame.data)
        others = (self.emcy_id, _SYNC_COB_ID, _TIME_COB_ID, _LSS_ANSWER)
        return _NodeFrames.OTHER if can_id in others else _NodeFrames.PDO


class _FaultyNode(Copyable, DeviceBefore[Frames]):
    """A node with faults on its frames; a `Device[Frames]` around the node.

    Args:
        device: the node, or its recorder.
        faults: the armed faults.
    """

    def __init__(self, device: Any, faults: NodeFaults) -> None:
        super().__init__(device)
        self._faults = faults

    @property
    def due_us(self) -> int:
        """Time at which the device is due or a fault acts."""
        return min(super().due_us, self._faults.due_us)

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Tick the device with the received frames after faults; return its frames after faults."""
        received, extra = self._faults.before(now_us, rx)
        sent: Frames = ()
        if received or self._device.due_us <= now_us:
            sent = self._device.tick(now_us, received)
        left = self._faults.after(now_us, sent) + extra
        if self._faults.idle and self._faults.station is not None:
            self._faults.station.device = self._device
        return left
