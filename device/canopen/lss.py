"""LSS: a slave whose node ID and bit rate are set over the bus (CiA 305)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from operator import eq, ge, le
from typing import Final

from tickrig.device.canopen.slave import UNCONFIGURED, CanopenSlave, Handler, Service
from tickrig.device.twin import Part
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.lss import (
    BIT_RATES,
    FASTSCAN_RESET,
    LSS_MASTER_COB_ID,
    LSS_SLAVE_COB_ID,
    MESSAGE_BYTES,
    STANDARD_TABLE,
    FastScan,
    LssAddress,
    LssCommand,
    LssError,
    LssMode,
    message,
    number_of,
)
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.instant import NEVER

# LSS slave: node-ID and bit timing over the bus (CiA 305).

_IDENTITY: Final = 0x1018
_NODE_IDS: Final = (*range(1, 128), UNCONFIGURED)

_MAX_BIT: Final = 31
_MAX_SUB: Final = 3

_Test = tuple[int, Callable[[int, int], bool]]
"""A part of the LSS address, and the comparison with the number in a message."""

SELECTIVE: Final[tuple[_Test, ...]] = ((0, eq), (1, eq), (2, eq), (3, eq))
"""Tests for "switch state selective": the whole LSS address."""

_IDENTIFY: Final[tuple[_Test, ...]] = ((0, eq), (1, eq), (2, le), (2, ge), (3, le), (3, ge))
"""Tests for "identify remote slave": revision and serial number in a range, bounds included."""


class MessageSequence(Part):
    """Recognises an LSS request of several messages, such as "switch state selective".

    A wrong or missing message cancels the request.

    Args:
        tests: one test for each message, in the order of the messages.
    """

    def __init__(self, tests: tuple[_Test, ...]) -> None:
        self._tests, self._step = tests, 0

    def take(self, step: int, address: LssAddress, number: int) -> bool:
        """Handle a message; return whether it was the last message and all messages match."""
        # 40h vendor, 41h product, 42h revision, 43h serial number. Message 40h starts the request
        # again. A message that does not match or is out of order cancels the request until the
        # next 40h.
        if step == 0:
            self._step = 0
        part, fits = self._tests[step]
        if step != self._step or not fits(number, address[part]):
            self._step = len(self._tests)
            return False
        self._step += 1
        return self._step == len(self._tests)


class FastScanner(Part):
    """Follows a fastscan, one part of the LSS address after the other."""

    def __init__(self) -> None:
        self._sub = 0

    def take(self, request: FastScan, address: LssAddress) -> LssMode | None:
        """Handle a request; return the next state if the request is answered, or None."""
        if request.bit_check == FASTSCAN_RESET:
            self._sub = 0
            return LssMode.WAITING
        if request.bit_check > _MAX_BIT or request.sub != self._sub:
            return None
        # Bits from 31 down to `bit_check` must agree; those below are not compared yet.
        if (address[self._sub] ^ request.id_number) >> request.bit_check:
            return None
        # Bit 0 matches, so the whole number is known. Only then does the scan continue with the
        # next number.
        if request.bit_check:
            return LssMode.WAITING
        return self._advance(request)

    def _advance(self, request: FastScan) -> LssMode | None:
        """Continue with the next part.

        If the next part comes before the present part, the scan has found all parts.
        """
        if request.next_sub > _MAX_SUB:
            return None
        self._sub = request.next_sub
        return LssMode.CONFIGURATION if request.next_sub < request.sub else LssMode.WAITING


class LssSlave(Service):
    """Obeys the LSS master, in every NMT state.

    A new node-ID takes effect at the next reset. An unconfigured slave boots with the new node-ID
    when LSS returns to the waiting state. A node-ID that is not stored is lost at power-off. Any
    reset returns LSS to the waiting state.

    Selective switching and fastscan work only in the waiting state. Fastscan and "identify
    non-configured" work only in a slave that has neither an active nor a pending node-ID. A new
    bit rate takes effect when it is activated: the slave sends nothing for two switch delays and
    switches between the two (`node.on_bit_rate`). LSS is off if one of 1018h:01 to 04 is missing.

    Not emulated: manufacturer-specific bit timing tables, automatic bit rate
    detection (index 9); both are refused with error 1.
    """

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._identity = node.dictionary.elements(_IDENTITY, len(LssAddress._fields))
        self._mode = LssMode.WAITING
        self._bit_rate_index: int | None = None
        self._switch_us = NEVER
        self._selective, self._identify = MessageSequence(SELECTIVE), MessageSequence(_IDENTIFY)
        self._fastscan = FastScanner()

    def power_on(self) -> None:
        """Start with the stored bit rate."""
        self._switch_us = NEVER
        self._bit_rate_index = self.node.nonvolatile.bit_rate_index
        self._notify_bit_rate()

    def start(self) -> None:
        """Return to waiting; a pending switch of the bit rate still takes place."""
        self._mode = LssMode.WAITING
        self.schedule(self._switch_us)

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the LSS master, also while initialising."""
        if len(self._identity) == len(LssAddress._fields):
            yield LSS_MASTER_COB_ID, self._receive

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Return the CAN-ID of the LSS master's frames, which may reconfigure the slave.

        A frame of the LSS master may give the slave a node-ID. The slave then boots, and receives
        frames with other CAN-IDs than before.
        """
        return (can_id for can_id, _ in self.handlers(state))

    def tick(self, now_us: int) -> None:
        """Switch the bit rate."""
        self._switch_us = NEVER
        self._notify_bit_rate()

    @property
    def _address(self) -> LssAddress:
        return LssAddress(*(entry.number for entry in self._identity))

    @property
    def _is_unconfigured(self) -> bool:
        return self.node.node_id == self.node.pending_id == UNCONFIGURED

    def _receive(self, frame: CanFrame) -> None:
        data = frame.data
        if len(data) == MESSAGE_BYTES:
            command = _COMMANDS[self._mode].get(data[0])
            if command is not None:
                command(self, data)

    def _answer(self, command: LssCommand, number: int = 0) -> None:
        self.node.send(LSS_SLAVE_COB_ID, message(command, number))

    def _acknowledge(self, command: LssCommand, allowed: bool) -> None:
        self._answer(command, LssError.NONE if allowed else LssError.OUT_OF_RANGE)

    def _switch_global(self, data: bytes) -> None:
        # 04 01: all slaves to configuration; 04 00: back to waiting.
        if data[1] == LssMode.CONFIGURATION:
            self._mode = LssMode.CONFIGURATION
        elif data[1] == LssMode.WAITING:
            self._mode = LssMode.WAITING
            node = self.node
            if node.node_id == UNCONFIGURED and node.pending_id != UNCONFIGURED:
                node.reset_communication()

    def _switch_selective(self, data: bytes) -> None:
        step = data[0] - LssCommand.SWITCH_VENDOR
        if self._selective.take(step, self._address, number_of(data)):
            self._mode = LssMode.CONFIGURATION
            self._answer(LssCommand.SWITCHED)

    def _identify_remote(self, data: bytes) -> None:
        step = data[0] - LssCommand.IDENTIFY_VENDOR
        if self._identify.take(step, self._address, number_of(data)):
            self._answer(LssCommand.IDENTIFIED)

    def _identify_non_configured(self, data: bytes) -> None:
        if self._is_unconfigured:
            self._answer(LssCommand.NON_CONFIGURED)

    def _scan(self, data: bytes) -> None:
        if not self._is_unconfigured:
            return
        mode = self._fastscan.take(FastScan.parse(data), self._address)
        if mode is not None:
            self._mode = mode
            self._answer(LssCommand.IDENTIFIED)

    def _configure_node_id(self, data: bytes) -> None:
        # 11 nn: the node-ID of the next reset; FFh makes the slave unconfigured again.
        allowed = data[1] in _NODE_IDS
        if allowed:
            self.node.pending_id = data[1]
        self._acknowledge(LssCommand.CONFIGURE_NODE_ID, allowed)

    def _configure_bit_timing(self, data: bytes) -> None:
        # 13 table index: 13 00 04 is 125 kbit/s.
        allowed = data[1] == STANDARD_TABLE and data[2] in BIT_RATES
        if allowed:
            self._bit_rate_index = data[2]
        self._acknowledge(LssCommand.CONFIGURE_BIT_TIMING, allowed)

    def _activate_bit_timing(self, data: bytes) -> None:
        # 15 ll hh: switch delay in ms. The slave waits for it twice. The delay before the switch
        # makes sure that all nodes are quiet when the first one changes its bit rate. The delay
        # after the switch makes sure that all nodes have changed when the first one sends.
        delay_us = int.from_bytes(data[1:3], "little") * 1_000
        self._switch_us = self.node.now_us + delay_us
        self.node.silent_until_us = self._switch_us + delay_us
        self.schedule(self._switch_us)

    def _store(self, data: bytes) -> None:
        nonvolatile = self.node.nonvolatile
        # 17: what was configured and not what is active; it may not have been activated
        # yet.
        nonvolatile.node_id = self.node.pending_id
        nonvolatile.bit_rate_index = self._bit_rate_index
        nonvolatile.changed()
        self._acknowledge(LssCommand.STORE, allowed=True)

    def _inquire(self, data: bytes) -> None:
        command = LssCommand(data[0])
        self._answer(command, self._address[command - LssCommand.INQUIRE_VENDOR])

    def _inquire_node_id(self, data: bytes) -> None:
        self._answer(LssCommand.INQUIRE_NODE_ID, self.node.node_id)

    def _notify_bit_rate(self) -> None:
        """Pass the bit rate to the subscribers, if one was configured."""
        bit_rate = BIT_RATES.get(-1 if self._bit_rate_index is None else self._bit_rate_index)
        if bit_rate is not None:
            for notify in self.node.on_bit_rate:
                notify(bit_rate)


_Command = Callable[[LssSlave, bytes], None]

_ALWAYS: Final[Mapping[int, _Command]] = {
    LssCommand.SWITCH_GLOBAL: LssSlave._switch_global,
    LssCommand.IDENTIFY_NON_CONFIGURED: LssSlave._identify_non_configured,
    **{LssCommand.IDENTIFY_VENDOR + n: LssSlave._identify_remote for n in range(len(_IDENTIFY))},
}
_COMMANDS: Final[Mapping[LssMode, Mapping[int, _Command]]] = {
    LssMode.WAITING: {
        **_ALWAYS,
        LssCommand.FASTSCAN: LssSlave._scan,
        **{LssCommand.SWITCH_VENDOR + n: LssSlave._switch_selective for n in range(len(SELECTIVE))},
    },
    LssMode.CONFIGURATION: {
        **_ALWAYS,
        LssCommand.CONFIGURE_NODE_ID: LssSlave._configure_node_id,
        LssCommand.CONFIGURE_BIT_TIMING: LssSlave._configure_bit_timing,
        LssCommand.ACTIVATE_BIT_TIMING: LssSlave._activate_bit_timing,
        LssCommand.STORE: LssSlave._store,
        LssCommand.INQUIRE_NODE_ID: LssSlave._inquire_node_id,
        **{LssCommand.INQUIRE_VENDOR + n: LssSlave._inquire for n in range(len(SELECTIVE))},
    },
}
"""Handlers of messages, by command specifier."""
