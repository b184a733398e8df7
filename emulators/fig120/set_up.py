"""What the master of Fig. 120 does before it leaves the bus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import canopen

PALETTE: Final = 16
MOTOR: Final = 32

LINK: Final = 0x290
"""COB-ID of the PDO link: TPDO2 of the palette, RPDO2 of the motor core unit."""

OFF: Final = 1 << 31


@dataclass(frozen=True, slots=True)
class Write:
    """One expedited SDO download.

    Attributes:
        node_id: the server.
        index: of the object.
        sub: of the object.
        value: what to write.
        size: bytes.
        text: what for.
    """

    node_id: int
    index: int
    sub: int
    value: int
    size: int
    text: str


WRITES: Final = (
    Write(PALETTE, 0x1017, 0, 100, 2, "heartbeat each 100 ms"),
    Write(MOTOR, 0x1017, 0, 100, 2, "heartbeat each 100 ms"),
    Write(PALETTE, 0x1801, 1, OFF | LINK, 4, "TPDO2 off"),
    Write(PALETTE, 0x1A01, 0, 0, 1, "no entries"),
    Write(PALETTE, 0x1A01, 1, 0x6401_0110, 4, "analogue input 1, 16 bit"),
    Write(PALETTE, 0x1A01, 0, 1, 1, "one entry"),
    Write(PALETTE, 0x1801, 2, 255, 1, "event-driven"),
    Write(PALETTE, 0x1801, 3, 100, 2, "inhibit time 10 ms"),
    Write(PALETTE, 0x1801, 5, 50, 2, "event timer 50 ms"),
    Write(PALETTE, 0x6426, 1, 8, 4, "delta: more than one step of the converter"),
    Write(PALETTE, 0x6423, 0, 1, 1, "analogue events on"),
    Write(PALETTE, 0x1801, 1, LINK, 4, "TPDO2 on, COB-ID 290h"),
    Write(MOTOR, 0x2000, 0, 3, 1, "angle mode"),
    Write(MOTOR, 0x1401, 1, OFF | LINK, 4, "RPDO2 off, the palette's COB-ID"),
    Write(MOTOR, 0x1601, 0, 0, 1, "no entries"),
    Write(MOTOR, 0x1601, 1, 0x6411_0110, 4, "reference, 16 bit"),
    Write(MOTOR, 0x1601, 0, 1, 1, "one entry"),
    Write(MOTOR, 0x1401, 2, 255, 1, "act on reception"),
    Write(MOTOR, 0x1401, 1, LINK, 4, "RPDO2 on: the link is made"),
)
"""In this order (NEDO report, 3.4.43.3, Fig. 120: PDO linking)."""

PATIENCE_S: Final = 30.0
"""How long an SDO answer may take on a busy machine; the library waits 0.3 s and tries once."""

START_ORDER: Final = (MOTOR, PALETTE)


def set_up(network: canopen.Network) -> None:
    """Link the potentiometer with the motor, and start both nodes.

    Raises:
        canopen.SdoCommunicationError: a node does not answer.
        canopen.SdoAbortedError: it refuses.
    """
    nodes = {
        node_id: network.add_node(node_id, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]  # canopen's
        for node_id in (PALETTE, MOTOR)
    }
    for node in nodes.values():
        node.sdo.RESPONSE_TIMEOUT = PATIENCE_S
    for write in WRITES:
        data = write.value.to_bytes(write.size, "little")
        nodes[write.node_id].sdo.download(write.index, write.sub, data)
    for node_id in START_ORDER:
        nodes[node_id].nmt.send_command(1)
