"""A host on a connection that speaks telnet with the serial options of RFC 2217."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from typing import Final

from serial import SerialBase, rfc2217
from serial.rfc2217 import COM_PORT_OPTION, IAC, IAC_DOUBLED, PortManager

from tickrig.emulators.serial.network.host_connection import HostConnection

SIGNATURE: Final = b"tickrig"
MAX_UNSENT_BYTES: Final = 8_192
MAX_SUBOPTION_BYTES: Final = 256

VALUE_BYTES: Final = {
    **dict.fromkeys(
        [
            rfc2217.SET_DATASIZE,
            rfc2217.SET_PARITY,
            rfc2217.SET_STOPSIZE,
            rfc2217.SET_CONTROL,
            rfc2217.SET_LINESTATE_MASK,
            rfc2217.SET_MODEMSTATE_MASK,
            rfc2217.PURGE_DATA,
        ],
        1,
    ),
    rfc2217.SET_BAUDRATE: 4,
}
"""How long the value of a command is at least."""

KNOWN_VALUES: Final[Mapping[bytes, Mapping[int, object]]] = {
    rfc2217.SET_PARITY: rfc2217.RFC2217_REVERSE_PARITY_MAP,
    rfc2217.SET_STOPSIZE: rfc2217.RFC2217_REVERSE_STOPBIT_MAP,
}
NO_FLOW_CONTROL_IN: Final = 14
NO_FLOW_CONTROL: Final = 1


class QuietAdapter(SerialBase):
    """The settings of a serial adapter with nothing on its modem lines: all of them are off."""

    cts = dsr = ri = cd = False

    def reset_input_buffer(self) -> None:
        """Do nothing: what the device sent is on its way to the host, who drops it there."""

    def reset_output_buffer(self) -> None:
        """Do nothing: what came before is on the line."""


class SafePortManager(PortManager):
    """pyserial's, made whole: it answers what RFC 2217 has answered, and survives any value."""

    def _telnet_process_subnegotiation(self, suboption: bytes) -> None:
        option, command, value = suboption[:1], suboption[1:2], suboption[2:]
        if option != COM_PORT_OPTION or len(value) < VALUE_BYTES.get(command, 0):
            return
        if command in KNOWN_VALUES and value[0] not in KNOWN_VALUES[command]:
            suboption = option + command + b"\0"  # it is told what is set
        if command == b"\0":
            self.rfc2217_send_subnegotiation(b"\x64", SIGNATURE)
        elif command == rfc2217.SET_CONTROL and (state := self._control_state(value[0])):
            self.rfc2217_send_subnegotiation(rfc2217.SERVER_SET_CONTROL, bytes([state]))
        else:
            super()._telnet_process_subnegotiation(suboption)  # type: ignore[misc] # no stub
            if command in (rfc2217.SET_LINESTATE_MASK, rfc2217.SET_MODEMSTATE_MASK):
                self.rfc2217_send_subnegotiation(rfc2217.RFC2217_ANSWER_MAP[command], value[:1])

    def _control_state(self, request: int) -> int:
        """Return what is answered to SET-CONTROL where pyserial has no answer, else 0."""
        port = self.serial
        for query, is_on in ((4, port.break_condition), (7, port.dtr), (10, port.rts)):
            if request == query:
                return query + 1 if is_on else query + 2
        if request in range(13, 17):
            return NO_FLOW_CONTROL_IN
        return NO_FLOW_CONTROL if request in range(17, 20) else 0


class Rfc2217Connection(HostConnection):
    """A host that may set the port, as on a serial server; pyserial's `rfc2217://` is one.

    What it sets is answered and remembered, and changes nothing on the line: the device has
    its own rate. Its DTR, RTS and break reach nobody; CTS, DSR, CD and RI are off. One whose
    telnet cannot be understood is left. Not emulated: FLOWCONTROL-SUSPEND, and purging what
    is on the line already.

    Args:
        connection: to the host.
        buffer_bytes: bytes kept for a host that does not read.
        baud: what the port is set to until the host sets it, with 8N1.
    """

    def __init__(self, connection: socket.socket, buffer_bytes: int, baud: int) -> None:
        super().__init__(connection, buffer_bytes)
        self._adapter = QuietAdapter(baudrate=baud)  # type: ignore[abstract] # it carries no bytes
        # typeshed wants two pyserial ports; any port and a writer will do (pyserial docs)
        self._manager = SafePortManager(self._adapter, self)  # type: ignore[arg-type]

    @property
    def setting(self) -> str:
        """What it has set the port to, as `9600 8N1`."""
        port = self._adapter
        return f"{port.baudrate} {port.bytesize}{port.parity}{port.stopbits}"

    def write(self, data: bytes) -> None:
        """Answer a negotiation; pyserial's manager calls this."""
        self._unsent += data

    @property
    def _may_read(self) -> bool:
        return len(self._unsent) < MAX_UNSENT_BYTES

    def _take_in(self, data: bytes) -> bytes:
        try:
            taken = b"".join(self._manager.filter(data))
        except TypeError:  # how pyserial's manager fails at it
            self.mistake = "IAC SE without IAC SB"
            return b""
        if len(self._manager.suboption or b"") > MAX_SUBOPTION_BYTES:
            self.mistake = f"IAC SB without IAC SE in {MAX_SUBOPTION_BYTES} bytes"
        return taken

    def _give_out(self, traffic: bytes) -> bytes:
        return traffic.replace(IAC, IAC_DOUBLED)
