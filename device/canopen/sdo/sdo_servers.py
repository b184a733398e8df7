"""All SDO servers of a slave (CiA 301, SDO server parameter; objects 1200h to 127Fh)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

from tickrig._compiled import mypyc_attr
from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.cob_id_rules import check_sdo_cob_id, is_valid
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import ALIVE, Handler, Service
from tickrig.device.canopen.sdo.sdo_server import USUAL, SdoLimits, SdoServer
from tickrig.wire.canopen.cob_id import CAN_ID_MASK
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo.abort import AbortCode
from tickrig.wire.canopen.sdo.sdo_command import REQUEST_COB_ID, RESPONSE_COB_ID
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.device.canopen.core.slave import CanopenSlave

DEFAULT_SERVER: Final = 0x1200
ADDITIONAL_SERVERS: Final = range(0x1201, 0x1280)
CLIENT_TO_SERVER: Final = 1
SERVER_TO_CLIENT: Final = 2


class _Additional(NamedTuple):
    """A server with the two COB-IDs that rule it."""

    server: SdoServer
    request: Entry
    response: Entry

    @property
    def exists(self) -> bool:
        return is_valid(self.request.number) and is_valid(self.response.number)

    def configure(self) -> None:
        """Take over the CAN-IDs; a server that has been switched off ends its transfer."""
        if self.exists:
            self.server.request_id = self.request.number & CAN_ID_MASK
            self.server.response_id = self.response.number & CAN_ID_MASK


@mypyc_attr(allow_interpreted_subclasses=True)
class SdoServers(Service):
    """The default server and the additional ones.

    The default server is there without 1200h too; 1200h, where it is, always
    tells the truth and cannot be written. An additional server serves as soon
    as both its COB-IDs are valid; a CAN-ID changes only while its own COB-ID is
    invalid. Bit 30 (dynamic) is kept and has no effect. Transfers end silently
    when the slave leaves Pre-operational and Operational.

    Not emulated: 29-bit CAN-IDs, a check of two servers on one CAN-ID.

    Attributes:
        default: the server of 1200h.
        limits: what all its servers put up with.
    """

    def __init__(self, node: CanopenSlave, slot: int, limits: SdoLimits = USUAL) -> None:
        super().__init__(node, slot)
        self._due_us, self.limits = NEVER, limits
        self.default = SdoServer(node, self._wake, limits)
        self._additional = [
            _Additional(SdoServer(node, self._wake, limits), request, response)
            for index in node.dictionary.within(ADDITIONAL_SERVERS)
            if (request := node.dictionary.find(index, CLIENT_TO_SERVER))
            and (response := node.dictionary.find(index, SERVER_TO_CLIENT))
        ]
        for additional in self._additional:
            for entry in (additional.request, additional.response):
                entry.guard = check_sdo_cob_id
                entry.written = self._configure
        self.servers = [self.default, *(additional.server for additional in self._additional)]

    def limit(self, limits: SdoLimits) -> None:
        """Put up with other limits, from the next request on.

        Args:
            limits: the new ones.
        """
        self.limits = limits
        for server in self.servers:
            server.limit(limits)

    def start(self) -> None:
        """Take the power-on values into service."""
        self._due_us = NEVER
        self._end_all()
        self.default.request_id = REQUEST_COB_ID + self.node.node_id
        self.default.response_id = RESPONSE_COB_ID + self.node.node_id
        self._describe(CLIENT_TO_SERVER, self.default.request_id)
        self._describe(SERVER_TO_CLIENT, self.default.response_id)
        for additional in self._additional:
            additional.configure()

    def _describe(self, sub: int, can_id: int) -> None:
        entry = self.node.dictionary.find(DEFAULT_SERVER, sub)
        if entry is not None and entry.data_type is DataType.UNSIGNED32:
            entry.assign(can_id.to_bytes(entry.size, "little"))
            entry.guard = _refuse

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the clients in Pre-operational and Operational."""
        if state in ALIVE:
            yield self.default.request_id, self.default.receive
            for additional in self._additional:
                if additional.exists:
                    yield additional.server.request_id, additional.server.receive

    def reconfigured_by(self, state: NmtState) -> Iterator[int]:
        """Name the clients: they write COB-IDs, heartbeat consumers, mappings."""
        return (can_id for can_id, _ in self.handlers(state))

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        """Drop transfers with the state that served them."""
        if new not in ALIVE:
            self._end_all()

    def tick(self, now_us: int) -> None:
        """Look for clients that have been silent too long."""
        for server in self.servers:
            if server.due_us <= now_us:
                server.abort(AbortCode.TIMEOUT)
        self._due_us = min(server.due_us for server in self.servers)
        self.schedule(self._due_us)

    def _wake(self, due_us: int) -> None:
        """See that no server's time passes; waking too early does no harm."""
        if due_us < self._due_us:
            self._due_us = due_us
            self.schedule(due_us)

    def _configure(self, entry: Entry) -> None:
        """Follow a COB-ID that the bus has changed."""
        for additional in self._additional:
            additional.configure()
            if not additional.exists:
                additional.server.end()
        self.node.rewire()

    def _end_all(self) -> None:
        for server in self.servers:
            server.end()


def _refuse(_entry: Entry, _value: Value) -> None:
    raise SdoAbort(AbortCode.READ_ONLY)
