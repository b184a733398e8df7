"""A Modbus RTU master that does not wait. Begin a request, and poll for its answer later."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

from tickrig.host.links.link import Link
from tickrig.wire import modbus
from tickrig.wire.errors import WireError

TIMEOUT_US: Final = 20_000
"""Longest time until an answer (rh3-control, drive protocol)."""

_CODES: Final = {code.value: code for code in modbus.ExceptionCode}


@dataclass(frozen=True, slots=True)
class ModbusAnswer:
    """Answer of a Modbus slave to a request of `ModbusMaster`.

    Attributes:
        request: request that was answered.
        values: registers that were read.
        refusal: exception code with which the slave refused the request, or None.
    """

    request: modbus.Request
    values: tuple[int, ...] = ()
    refusal: modbus.ExceptionCode | int | None = None


class ModbusMaster:
    """A Modbus master that sends requests to one slave, one request at a time.

    On a line with echo, the master skips its own frames. A late answer counts as the answer to the
    next request, if it has the same form.

    pymodbus and minimalmodbus wait on the machine's clock and cannot wait on the clock of a rig.
    Therefore this class implements the master, with the codec of the slave. The tests of the slave
    use those libraries.

    Args:
        link: line to the slave.
        address: address of the slave, 1..247.
        timeout_us: longest time until an answer.
        retries: number of repetitions of a request without an answer.

    Attributes:
        pending: request that is under way.
        misses: number of requests in a row without an answer.
        lost: total number of requests without an answer, for statistics.
    """

    def __init__(
        self, link: Link[bytes], address: int = 1, timeout_us: int = TIMEOUT_US, retries: int = 1
    ) -> None:
        self._link, self._address = link, address
        self._timeout_us, self._retries = timeout_us, retries
        self.pending: modbus.Request | None = None
        self.misses = self.lost = 0
        self._sent = self._received = b""
        self._tries = self._until_us = 0

    def begin(self, request: modbus.Request) -> None:
        """Send a request without waiting for its answer, which `poll` returns later.

        If an earlier request has no answer yet, that request is dropped.

        Raises:
            LinkClosed: the line is closed.
        """
        self.pending, self._tries = request, 0
        self._send(request)

    def poll(self) -> ModbusAnswer | None:
        """Return the answer to the request if it has arrived, otherwise None. Call this repeatedly.

        If the answer does not arrive in time, the request is sent again.

        Raises:
            LinkClosed: the line is closed.
        """
        received = self._link.receive(0)
        if (request := self.pending) is None:
            return None
        self._received = (self._received + received)[-modbus.MAX_FRAME_BYTES :]
        answer = self._parse(request)
        if answer is not None:
            self.pending, self.misses = None, 0
        elif self._link.now_us >= self._until_us:
            self._miss(request)
        return answer

    def close(self) -> None:
        """Release the line."""
        self._link.close()

    def _send(self, request: modbus.Request) -> None:
        self._link.receive(0)
        self._received = b""
        self._sent = modbus.encode_frame(self._address, modbus.encode_request(request))
        self._link.send(self._sent)
        self._until_us = self._link.now_us + self._timeout_us

    def _miss(self, request: modbus.Request) -> None:
        self.lost += 1
        if self._tries < self._retries:
            self._tries += 1
            self._send(request)
        else:
            self.pending = None
            self.misses += 1

    def _parse(self, request: modbus.Request) -> ModbusAnswer | None:
        frame = self._received
        if len(frame) > len(self._sent) and frame.startswith(self._sent):
            frame = frame[len(self._sent) :]  # the adapter hears what it says
        try:
            address, message = modbus.parse_frame(frame)
        except WireError:
            return None
        if address != self._address or message[0] & ~modbus.ERROR_BIT != request.function:
            return None
        if message[0] & modbus.ERROR_BIT:
            return ModbusAnswer(request, refusal=_code(message[1]))
        if request.read is None:
            return ModbusAnswer(request) if message == modbus.encode_response(request) else None
        count = request.read[1]
        if len(message) != 2 + 2 * count:
            return None
        return ModbusAnswer(request, struct.unpack_from(f">{count}H", message, 2))


def _code(number: int) -> modbus.ExceptionCode | int:
    return _CODES.get(number, number)
