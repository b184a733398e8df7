r"""Contents of frames with more than a single byte of data.

>>> LitePortData(b"in", b"\x2a\x00\x00\x00").encode().hex(" ")
'02 04 69 6e 2a 00 00 00'
>>> from tickrig.wire.rtc_lite.codes import LiteCommand
>>> parse_reply(LiteFrame(LiteCommand.ACTIVATE, b"xE"))
LiteReply(status=120, fields=b'E')
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.wire.errors import FieldError, FramingError
from tickrig.wire.rtc_lite.codes import LiteStatus
from tickrig.wire.rtc_lite.frame import MAX_DATA_BYTES, REPLIES, LiteFrame

PORT_COUNTS_BYTES: Final = 2
"""Number of bytes for the lengths of name and data, which precede name and data."""


@dataclass(frozen=True, slots=True)
class LitePortData:
    """Data of the RTC-Lite frame that sends a value to an in-port (PS) or from an out-port (QV).

    Attributes:
        name: name of the port, as on the wire.
        data: marshalled value.
    """

    name: bytes
    data: bytes

    def __post_init__(self) -> None:
        """Raise FieldError if the message does not fit into a frame."""
        size = PORT_COUNTS_BYTES + len(self.name) + len(self.data)
        if size > MAX_DATA_BYTES:
            raise FieldError(f"name and data make {size} data bytes, {MAX_DATA_BYTES} fit")

    def encode(self) -> bytes:
        """Write the data of the frame."""
        return bytes([len(self.name), len(self.data)]) + self.name + self.data


@dataclass(frozen=True, slots=True)
class LitePortProfile:
    """Data of the RTC-Lite frame with which a device describes one of its ports.

    The frame is PP for an in-port and QQ for an out-port.

    Attributes:
        code: letter of the type of the port, which may be unknown.
        name: name of the port.
    """

    code: str
    name: bytes

    def encode(self) -> bytes:
        """Write the data of the frame."""
        return bytes([1 + len(self.name)]) + self.code.encode("latin-1") + self.name


@dataclass(frozen=True, slots=True)
class LiteComponentProfile:
    """Data of the RTC-Lite reply (CZ) that ends the description of a component.

    Before this reply the device has sent a frame for each port.

    Attributes:
        in_ports: number of PP frames that were sent, one for each in-port.
        out_ports: number of QQ frames that were sent, one for each out-port.
        type_name: type of the component.
    """

    in_ports: int
    out_ports: int
    type_name: bytes

    def encode(self) -> bytes:
        """Write the fields of the reply."""
        return bytes([self.in_ports, self.out_ports, len(self.type_name)]) + self.type_name


@dataclass(frozen=True, slots=True)
class LiteReply:
    """The reply of an RTC-Lite device to a request: a status, and further bytes.

    Attributes:
        status: status as a `LiteStatus`, or an unknown number.
        fields: bytes after the status: state, sequence number or context type.
    """

    status: int
    fields: bytes = b""

    @property
    def ok(self) -> bool:
        """Whether the device executed the request."""
        return self.status == LiteStatus.OK

    def encode(self) -> bytes:
        """Write the data of the frame."""
        return bytes([self.status]) + self.fields


def parse_port_data(data: bytes) -> LitePortData:
    """Parse the data of an RTC-Lite frame that sends the value of a port (PS or QV).

    Raises:
        FramingError: the lengths of name and value do not match the frame.
    """
    size = 2 + data[0] + data[1] if len(data) >= PORT_COUNTS_BYTES else PORT_COUNTS_BYTES
    if len(data) != size:
        raise FramingError(f"{data.hex(' ')} has {len(data)} bytes, {size} were expected")
    end = PORT_COUNTS_BYTES + data[0]
    return LitePortData(data[PORT_COUNTS_BYTES:end], data[end:])


def parse_port_profile(data: bytes) -> LitePortProfile:
    """Parse the data of an RTC-Lite frame that describes a port (PP or QQ).

    Raises:
        FramingError: the length of the name does not match the frame.
    """
    if not data or not 1 <= data[0] == len(data) - 1:
        raise FramingError(f"{data.hex(' ')} is not a length, a letter and a name")
    return LitePortProfile(chr(data[1]), data[2:])


def parse_component_profile(fields: bytes) -> LiteComponentProfile:
    """Parse the fields of the RTC-Lite reply that ends the description of a component (CZ).

    Raises:
        FramingError: the length of the name does not match the fields.
    """
    if len(fields) < 3 or len(fields) != 3 + fields[2]:
        raise FramingError(f"{fields.hex(' ')} is not two numbers, a length and a name")
    return LiteComponentProfile(fields[0], fields[1], fields[3:])


def parse_reply(frame: LiteFrame) -> LiteReply:
    """Parse the data of a reply frame from an RTC-Lite device.

    Raises:
        FramingError: the frame is not a reply, or has a wrong length.
    """
    data, layout = frame.data, REPLIES[frame.command]
    if not data or layout(data) != len(data):
        raise FramingError(f"{frame.command.value.decode()} {data.hex(' ')} is not a reply")
    return LiteReply(data[0], data[1:])
