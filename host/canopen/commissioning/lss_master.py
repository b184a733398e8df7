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
"""Time that the master waits for the answer to a command."""
SCAN_US: Final = 20_000
"""Time to wait for answers to a question of a fastscan, which several slaves may answer."""
_SILENCE_US: Final = 200_000
"""Time within which late answers to a failed fastscan arrive."""
_PATIENCE: Final = (1, 2, 4)
"""Factors of the wait time in successive attempts of a fastscan."""
_SETTLE_US: Final = 5_000
"""Pause after a command without an answer, so that slow slaves can execute it."""
_BITS: Final = range(31, -1, -1)

INDICES: Final = {rate: index for index, rate in BIT_RATES.items()}
"""Index in the standard table by bit rate in bit/s."""
_SPECIFIC: Final = 0xFF
"""Error code for a reason that the manufacturer defines."""

_ERRORS: Final = {
    (LssCommand.CONFIGURE_NODE_ID, 1): "node-ID out of range",
    (LssCommand.CONFIGURE_BIT_TIMING, 1): "bit rate not supported",
    (LssCommand.STORE, 1): "it cannot store",
    (LssCommand.STORE, 2): "its memory cannot be accessed",
}


class LssFailed(Exception):  # noqa: N818 - what the slave did
    """An LSS command failed: a slave refused it, none answered, or more than one answered.

    Attributes:
        command: command that failed, or None if the failure is not due to a single command.
        code: error code that the slave sent, or 0 if no slave refused.
    """

    def __init__(self, message: str, command: LssCommand | None = None, code: int = 0) -> None:
        super().__init__(message)
        self.command, self.code = command, code


class LssMaster:
    """LSS master that sets the node-ID and bit rate of slaves over the bus (CiA 305).

    Only one LSS master may be active on a bus.

    Args:
        bus: bus to which the slaves are connected.
        answer_us: time to wait for the answer to a command, in microseconds.
        scan_us: time to wait for answers to one request of a fastscan, in microseconds. A fastscan
            sends 133 requests.

    Attributes:
        waiting: whether the LSS master has finished its work (method `at_work`) and has then
            switched all slaves to the LSS state waiting.
    """

    def __init__(self, bus: NodeBus, answer_us: int = _ANSWER_US, scan_us: int = SCAN_US) -> None:
        self.waiting = False
        self._bus, self._answer_us, self._scan_us = bus, answer_us, scan_us

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Switch all slaves to the LSS state waiting, before and after the `with` block.

        After the block, the slaves are switched even if the block raises an error.
        """
        self.switch_all(LssMode.WAITING)
        try:
            yield
        finally:
            with suppress(LinkClosed):
                self.switch_all(LssMode.WAITING)
                self.waiting = True

    def switch_all(self, mode: LssMode) -> None:
        """Switch all slaves, without an answer. New node-IDs take effect in state waiting."""
        self._bus.send(LSS_MASTER_COB_ID, message(LssCommand.SWITCH_GLOBAL, mode))
        self._bus.gather(_SETTLE_US)

    def select(self, address: LssAddress) -> bool:
        """Switch the slave with this address to configuration. Return False if no slave answers."""
        for number, part in enumerate(address[:3]):
            command = LssCommand(LssCommand.SWITCH_VENDOR + number)
            self._bus.send(LSS_MASTER_COB_ID, message(command, part))
            self._bus.gather(_SETTLE_US)
        answers = self._request(message(LssCommand.SWITCH_SERIAL, address.serial))
        return LssCommand.SWITCHED in (answer[0] for answer in answers)

    def fastscan(self) -> LssAddress | None:
        """Find a slave without a node-ID, and switch it to the LSS state configuration.

        Return the LSS address of this slave, or None if every slave has a node-ID.

        If answers of slaves arrive after the time-out of their request, the scan starts again with
        twice the time-out.

        Raises:
            LssFailed: in each scan, the answers of the slaves fit no LSS address.
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
                    break  # the slave that answered is gone
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
        """Return the LSS address of the slave in the LSS state configuration.

        Only one slave may be in this state. The method raises the same errors as
        `configure_node_id`.
        """
        inquiries = range(LssCommand.INQUIRE_VENDOR, LssCommand.INQUIRE_SERIAL + 1)
        answers = [self._command(message(LssCommand(inquiry))) for inquiry in inquiries]
        return LssAddress(*map(number_of, answers))

    def node_id(self) -> int:
        """Return the active node-ID of the slave in configuration, or 255 for none."""
        return self._command(message(LssCommand.INQUIRE_NODE_ID))[1]

    def count(self) -> int:
        """Return how many slaves in the LSS state configuration answer a node-ID request.

        A result above 1 means that a fastscan has found several slaves with the same LSS address.
        If such slaves answer at the same moment, their answers appear as one frame on the bus and
        count as one. If no slave supports the request, the result is 0.
        """
        return len(self._answers_to(message(LssCommand.INQUIRE_NODE_ID)))

    def configure_node_id(self, node_id: int) -> None:
        """Set the node-ID of the slave that is in the LSS state configuration.

        Args:
            node_id: new node-ID, 1..127, or 255 to remove the node-ID.

        Raises:
            LssFailed: the slave refuses or does not answer, or several slaves answer.
            LinkClosed: the connection to the bus is lost.
        """
        self._configure(message(LssCommand.CONFIGURE_NODE_ID, node_id))

    def configure_bit_rate(self, bit_rate: int) -> None:
        """Set the bit rate of the slave that is in the LSS state configuration.

        The method raises the same errors as `configure_node_id`.

        Args:
            bit_rate: bit rate in bit/s, one of `INDICES`.
        """
        number = STANDARD_TABLE | INDICES[bit_rate] << 8
        self._configure(message(LssCommand.CONFIGURE_BIT_TIMING, number))

    def activate_bit_rate(self, delay_ms: int) -> None:
        """Make all slaves in the LSS state configuration switch to the new bit rate after a delay.

        The slaves do not answer this command.
        """
        self._bus.send(LSS_MASTER_COB_ID, message(LssCommand.ACTIVATE_BIT_TIMING, delay_ms))

    def store(self) -> None:
        """Make the slave store node-ID and bit rate.

        The errors are those of `configure_node_id`.
        """
        self._configure(message(LssCommand.STORE))

    def _scan(self, request: FastScan, wait_us: int) -> bool:
        """Return whether a slave answers. Late answers of other slaves count too."""
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
        """Send a command. Return the first answers that arrive together."""
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
    """Return the name of a command in words.

    >>> _name(LssCommand.CONFIGURE_NODE_ID)
    'configure node-ID'
    """
    return command.name.lower().replace("_", " ").replace("node id", "node-ID")
