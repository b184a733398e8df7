"""LSS master: node-ID and bit rate of slaves over the bus (CiA 305)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.links.link import LinkClosed
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
    LssMode,
    message,
    number_of,
)

_ANSWER_US: Final = 500_000
"""How long an answer to a command is waited for."""
SCAN_US: Final = 20_000
"""How long answers to a question of a fastscan are waited for: several slaves may answer."""
_SILENCE_US: Final = 200_000
"""Answers to a fastscan that failed have come by then."""
_PATIENCE: Final = (1, 2, 4)
"""A fastscan is tried with so many times its wait."""
_SETTLE_US: Final = 5_000
"""After what nobody answers, so that slow slaves take it."""
MOST_FOUND: Final = 127
_BITS: Final = range(31, -1, -1)

INDICES: Final = {rate: index for index, rate in BIT_RATES.items()}
"""Index of the standard table by bit rate in bit/s."""
_SPECIFIC: Final = 0xFF
"""Error code whose reason is the manufacturer's."""

_ERRORS: Final = {
    (LssCommand.CONFIGURE_NODE_ID, 1): "node-ID out of range",
    (LssCommand.CONFIGURE_BIT_TIMING, 1): "bit rate not supported",
    (LssCommand.STORE, 1): "it cannot store",
    (LssCommand.STORE, 2): "its memory cannot be accessed",
}


class LssFailed(Exception):  # noqa: N818 - what the slave did
    """A slave refused, did not answer, or several answered where one may.

    Attributes:
        command: that failed, None where it was several.
        code: with which the slave refused, 0 if it did not.
    """

    def __init__(self, message: str, command: LssCommand | None = None, code: int = 0) -> None:
        super().__init__(message)
        self.command, self.code = command, code


class LssMaster:
    """The LSS master of a bus; there may be no other.

    Args:
        bus: the bus.
        answer_us: how long an answer to a command is waited for.
        scan_us: how long answers to each of the 133 questions of a fastscan are waited for.

    Attributes:
        waiting: all slaves were sent back to waiting, at the end of `at_work`.
    """

    def __init__(self, bus: NodeBus, answer_us: int = _ANSWER_US, scan_us: int = SCAN_US) -> None:
        self.waiting = False
        self._bus, self._answer_us, self._scan_us = bus, answer_us, scan_us

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Have all slaves wait at the beginning and at the end of the block, however it ends."""
        self.switch_all(LssMode.WAITING)
        try:
            yield
        finally:
            with suppress(LinkClosed):
                self.switch_all(LssMode.WAITING)
                self.waiting = True

    def switch_all(self, mode: LssMode) -> None:
        """Switch all slaves; nobody answers. A new node-ID counts when they wait again."""
        self._bus.send(LSS_MASTER_COB_ID, message(LssCommand.SWITCH_GLOBAL, mode))
        self._bus.gather(_SETTLE_US)

    def select(self, address: LssAddress) -> bool:
        """Switch the slave with this address to configuration; False if none answers."""
        for number, part in enumerate(address[:3]):
            command = LssCommand(LssCommand.SWITCH_VENDOR + number)
            self._bus.send(LSS_MASTER_COB_ID, message(command, part))
            self._bus.gather(_SETTLE_US)
        answers = self._request(message(LssCommand.SWITCH_SERIAL, address.serial))
        return LssCommand.SWITCHED in (answer[0] for answer in answers)

    def fastscan(self) -> LssAddress | None:
        """Find a slave without a node-ID; it is in configuration then. None if there is none.

        Where answers come too late for their questions it is begun anew, with twice the time.

        Raises:
            LssFailed: slaves answered in a way that fits no address, each time.
        """
        failed: LssFailed | None = None
        for factor in _PATIENCE:
            try:
                found = self._fastscan(factor * self._scan_us)
            except LssFailed as error:
                failed = error
                self._bus.gather(_SILENCE_US)
            else:
                if found is None and failed is not None:
                    break  # who had answered is gone
                return found
        assert failed is not None
        raise failed

    def _fastscan(self, wait_us: int) -> LssAddress | None:
        if not self._scan(FastScan(0, FASTSCAN_RESET, 0, 0), max(wait_us, _SILENCE_US)):
            return None
        found: list[int] = []
        for sub in range(4):
            number = 0
            for bit in _BITS:
                if not self._scan(FastScan(number, bit, sub, sub), wait_us):
                    number |= 1 << bit
            if not self._scan(FastScan(number, 0, sub, (sub + 1) % 4), wait_us):
                raise LssFailed(
                    f"fastscan: {number:08X}h as part {sub + 1} of the address is not confirmed;"
                    f" a slave is gone, or needs longer than {wait_us // 1_000} ms to answer"
                )
            found.append(number)
        return LssAddress(*found)

    def address(self) -> LssAddress:
        """Return the address of the one slave in configuration; raises as `configure_node_id`."""
        return LssAddress(
            *(
                number_of(self._command(message(LssCommand(LssCommand.INQUIRE_VENDOR + sub))))
                for sub in range(4)
            )
        )

    def node_id(self) -> int:
        """Return the active node-ID of the slave in configuration, 255 for none."""
        return self._command(message(LssCommand.INQUIRE_NODE_ID))[1]

    def count(self) -> int:
        """Return how many slaves in configuration answer; 0 if none knows the question.

        Slaves with the same address are found as one by a fastscan. Their answers are one
        frame if they are sent at the same moment, and count as one then.
        """
        return len(self._answers_to(message(LssCommand.INQUIRE_NODE_ID)))

    def configure_node_id(self, node_id: int) -> None:
        """Give the slave in configuration a node-ID.

        Args:
            node_id: 1..127, or 255 for none.

        Raises:
            LssFailed: it refuses or does not answer, or several answer.
            LinkClosed: the bus is gone.
        """
        self._configure(message(LssCommand.CONFIGURE_NODE_ID, node_id))

    def configure_bit_rate(self, bit_rate: int) -> None:
        """Give it a bit rate in bit/s, of `INDICES`; raises as `configure_node_id`."""
        number = STANDARD_TABLE | INDICES[bit_rate] << 8
        self._configure(message(LssCommand.CONFIGURE_BIT_TIMING, number))

    def activate_bit_rate(self, delay_ms: int) -> None:
        """Let all slaves in configuration switch their bit rate after a delay; nobody answers."""
        self._bus.send(LSS_MASTER_COB_ID, message(LssCommand.ACTIVATE_BIT_TIMING, delay_ms))

    def store(self) -> None:
        """Have it store both; raises as `configure_node_id`."""
        self._configure(message(LssCommand.STORE))

    def _scan(self, request: FastScan, wait_us: int) -> bool:
        """Return whether somebody answers; late answers of others belong to this question too."""
        self._bus.send(LSS_MASTER_COB_ID, request.encode())
        return any(answer[0] == LssCommand.IDENTIFIED for answer in self._gather(wait_us))

    def _configure(self, request: bytes) -> None:
        answer = self._command(request)
        if code := answer[1]:
            command = LssCommand(request[0])
            text = _ERRORS.get((command, code), f"error {code}")
            if code == _SPECIFIC:
                text = f"error {answer[2]} of its maker"
            raise LssFailed(f"LSS {_name(command)}: {text}", command, code)

    def _command(self, request: bytes) -> bytes:
        """Return the answer to a command."""
        command, found = LssCommand(request[0]), self._answers_to(request)
        if not found:
            within = f"{self._answer_us // 1_000} ms"
            raise LssFailed(f"LSS {_name(command)}: no answer within {within}", command)
        if len(found) > 1:
            raise LssFailed(f"LSS {_name(command)}: {len(found)} slaves answered, where one may")
        return found[0]

    def _answers_to(self, request: bytes) -> list[bytes]:
        """Return all answers to a command."""
        answers = [*self._request(request), *self._gather(_SETTLE_US)]
        return [answer for answer in answers if answer[0] == request[0]]

    def _request(self, request: bytes) -> list[bytes]:
        """Send; return the first answers that come together."""
        bus = self._bus
        bus.gather(0)
        bus.send(LSS_MASTER_COB_ID, request)
        until_us, now_us, found = bus.now_us + self._answer_us, bus.now_us, list[bytes]()
        while not found and now_us < until_us:
            now_us, frames = bus.listen(until_us)
            found += _answers(frame for _, frame in frames)
        return found

    def _gather(self, span_us: int) -> list[bytes]:
        return list(_answers(self._bus.gather(span_us)))


def _answers(frames: Iterable[CanFrame]) -> Iterator[bytes]:
    for frame in frames:
        whole = len(frame.data) == MESSAGE_BYTES and not (frame.remote or frame.extended)
        if frame.can_id == LSS_SLAVE_COB_ID and whole:
            yield frame.data


def _name(command: LssCommand) -> str:
    """Write a command for people.

    >>> _name(LssCommand.CONFIGURE_NODE_ID)
    'configure node-ID'
    """
    return command.name.lower().replace("_", " ").replace("node id", "node-ID")
