"""Our end of a connector of data ports, by corba_cdr (OpenRTM-aist 1.x)."""

from __future__ import annotations

from typing import Any, Final

from tickrig.host.rtc.engines.openrtm.ports.cdr import (
    InPortAnswers,
    InPortClient,
    OutPortAnswers,
    OutPortClient,
)
from tickrig.host.rtc.engines.openrtm.ports.ends import End, Place
from tickrig.host.rtc.engines.openrtm.ports.properties import ENDIAN, agreed
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.ports.connector_options import DataflowType
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.port import ConnectorBase
from tickrig.host.rtc.remote.in_port import InPortPullConnector, InPortPushConnector
from tickrig.host.rtc.remote.out_port import OutPortPullConnector, OutPortPushConnector
from tickrig.host.rtc.remote.peer_end import Codec, PeerEnd, cdr
from tickrig.host.rtc.states import RtcRefused
from tickrig.wire.rtc_types.cdr import Endian

INPORT_IOR: Final = "dataport.corba_cdr.inport_ior"
OUTPORT_IOR: Final = "dataport.corba_cdr.outport_ior"


class DataEnd(End):
    """The end of a data connector.

    Who is called by the peer publishes: an InPort that is pushed into, an OutPort that is
    pulled from. Who calls subscribes.

    Args:
        place: where it is.
        port: of ours.
    """

    def __init__(self, place: Place, port: InPort[Any] | OutPort[Any]) -> None:
        super().__init__(place)
        self._port = port
        self._connector: ConnectorBase | None = None

    def publish(self, values: dict[str, str]) -> dict[str, str]:
        """Serve InPortCdr or OutPortCdr, if the peer calls."""
        end, codec = self._agree(values)
        port, pulls = self._port, end.options.dataflow is DataflowType.PULL
        if isinstance(port, InPort) and not pulls:
            self._connector = put_into = InPortPushConnector(
                port, end, codec, self._place.calls, self._place.post
            )
            put_into.begin()  # the peer may push before its answer is here
            return {INPORT_IOR: self.serve("OpenRTM.InPortCdr", InPortAnswers(put_into))}
        if isinstance(port, OutPort) and pulls:
            self._connector = held = OutPortPullConnector(port, end, codec)
            held.begin()
            return {OUTPORT_IOR: self.serve("OpenRTM.OutPortCdr", OutPortAnswers(held))}
        return {}

    def join(self, values: dict[str, str]) -> ConnectorBase:
        """Reach the peer's InPortCdr or OutPortCdr, if we call."""
        if self._connector is None:
            self._connector = self._calling(values)
            self._connector.begin()
        return self._connector

    def _calling(self, values: dict[str, str]) -> ConnectorBase:
        end, codec = self._agree(values)
        place, port, openrtm = self._place, self._port, stubs().openrtm
        key = INPORT_IOR if isinstance(port, OutPort) else OUTPORT_IOR
        if (ior := values.get(key)) is None:
            raise RtcRefused(f"{place.peer} says no {key}")
        if isinstance(port, OutPort):
            put = InPortClient(self.reference(ior, openrtm.InPortCdr), place.peer)
            return OutPortPushConnector(port, end, codec, put, place.threads)
        get = OutPortClient(self.reference(ior, openrtm.OutPortCdr), place.peer)
        return InPortPullConnector(port, end, codec, get, place.threads, place.calls)

    def _agree(self, values: dict[str, str]) -> tuple[PeerEnd, Codec[Any, bytes]]:
        values = agreed(self._port, values)
        return self._place.end(values), cdr(self._port.data_type, Endian(values[ENDIAN]))
