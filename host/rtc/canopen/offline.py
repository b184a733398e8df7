"""Checks of a System Definition without a bus, in which EDS files answer for the nodes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

from tickrig.host.canopen.dialogue import SdoRequest, Step
from tickrig.host.canopen.errors import SdoAborted
from tickrig.host.rtc.canopen import definition
from tickrig.host.rtc.canopen.boot import boot
from tickrig.host.rtc.canopen.connections import are_there, check_lengths, find_layout
from tickrig.host.rtc.canopen.pdo_layout import PdoLayout
from tickrig.host.rtc.canopen.proxy import ProxyRtc, lay_out_sdo_ports
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.dot import Box, Edge, write_dot
from tickrig.wire.canopen import sdo
from tickrig.wire.canopen.nmt import CAN_ID_MASK
from tickrig.wire.canopen.sdo_frame import AbortCode

_Layouts = tuple[PdoLayout, ...]


def boot_offline(
    entry: definition.NodeEntry, file: definition.DeviceFile, writes: Iterable[definition.SdoEntry]
) -> _Layouts | None:
    """Simulate the set-up of a node from its EDS, without a bus, and return its enabled PDOs.

    The result is None if the EDS does not contain the needed values.

    Args:
        entry: settings of the node.
        file: content of the node's EDS.
        writes: values that are written while the node boots.
    """
    values = dict(file.defaults)
    script = boot(entry, file, writes)
    try:
        step = next(script)
        while True:
            step = script.send(_answer(step, values))
    except StopIteration as end:
        layouts: _Layouts = end.value
        return layouts
    except SdoAborted:
        return None


def _answer(step: Step, values: dict[tuple[int, int], bytes]) -> sdo.Response | None:
    """Answer as a device that has these values and accepts any value."""
    match sdo.parse_request(step.request) if isinstance(step, SdoRequest) else None:
        case sdo.UploadInitiateRequest(index=index, sub=sub):
            if (data := values.get((index, sub))) is None:
                return sdo.Abort(index, sub, AbortCode.NO_OBJECT)
            return sdo.UploadInitiateResponse(index, sub, data, len(data))
        case sdo.DownloadInitiateRequest(index=index, sub=sub, data=data):
            values[index, sub] = data or b""
            return sdo.DownloadInitiateResponse(index, sub)
        case sdo.Segment(toggle=toggle):
            return sdo.DownloadSegmentResponse(toggle)
    return None


def check_offline(server: RtcCanopenServer) -> tuple[str, ...]:
    """Check a System Definition without a bus.

    The check assumes that the nodes match their EDS. It does not check nodes whose EDS lacks
    values, or connections with components that the server does not have.

    Args:
        server: server that has the System Definition. The check adds proxies to it although there
            are no devices. Afterwards, do not use this server for anything else.

    Returns:
        A text for each error. For example, a node will refuse a setting, or several nodes send a
        PDO with the same COB-ID.
    """
    layouts = dict[int, _Layouts]()
    for node_id, node in server.nodes.items():
        if (on := boot_offline(node.entry, node.file, node.writes)) is not None:
            layouts[node_id] = on
    return (
        *_proxies(server, layouts),
        *_sent_twice(server, layouts),
        *(text for link in server.definition.pdo_links for text in _link(link, layouts)),
        *_connections(server),
    )


def _proxies(server: RtcCanopenServer, layouts: dict[int, _Layouts]) -> Iterator[str]:
    for node_id, on in layouts.items():
        try:
            node = server.nodes[node_id]
            made, refused = lay_out_sdo_ports(node.entry, node.file.data_types)
            yield from (f"nodes: {node.entry.name}.{text}" for text in refused)
            server.manager.add(ProxyRtc(node.entry, on, made))
        except RtcRefused as error:
            yield f"nodes: {error}"


def _sent_twice(server: RtcCanopenServer, layouts: dict[int, _Layouts]) -> Iterator[str]:
    senders = defaultdict[int, list[str]](list)
    for node_id, on in layouts.items():
        file = server.nodes[node_id].file
        for pdo in on:
            default = int.from_bytes(file.defaults.get((pdo.index, 1), b""), "little")
            kept = (pdo.index, 1) in file.relative and pdo.cob_id == default & CAN_ID_MASK
            if pdo.sends:
                senders[pdo.cob_id + kept * node_id].append(f"{node_id}.{pdo.name}")
    for cob_id, names in senders.items():
        if len(names) > 1:
            which = f"{' and '.join(names)} are {'both' if len(names) == 2 else 'all'}"
            yield f"pdos: {which} sent as {cob_id:03X}h; give each a cob_id of its own"


def _link(link: definition.PdoLink, layouts: dict[int, _Layouts]) -> Iterator[str]:
    ends = [
        (name, layouts[name.node]) for name in (link.source, link.target) if name.node in layouts
    ]
    try:
        found = [find_layout(name, on) for name, on in ends]
        if len(found) == 2:
            check_lengths(link, *found)
    except definition.ServerRefused as error:
        yield f"pdo_links: {error}"


def _connections(server: RtcCanopenServer) -> Iterator[str]:
    for entry in server.definition.rt_connections:
        try:
            if are_there(server.manager, entry):
                server.manager.connect(entry.source, entry.target, entry.properties)
        except RtcRefused as error:
            yield f"rt_connections: {error}"


def draw_graph(server: RtcCanopenServer) -> str:
    """Return a drawing of the system in the language of Graphviz.

    Connections through the PC are solid, and PDO links are dashed.

    Args:
        server: server that has the System Definition. This function changes the server by a call of
            `check_offline`. Afterwards, do not use the server for anything else.
    """
    check_offline(server)
    entries = {node.id: node for node in server.definition.nodes}

    def port(name: definition.PdoName) -> str:
        entry = entries[name.node]
        return f"{entry.name}.{entry.ports.get(name.pdo, name.pdo)}"

    titles = {node.name: f"node {node.id}" for node in entries.values()}
    return write_dot(
        (_box(one, titles.get(one.instance_name, "")) for one in server.manager.components),
        (
            *(Edge(*connector.ports) for connector in server.manager.connectors),
            *(
                Edge(port(link.source), port(link.target), dashed=True)
                for link in server.definition.pdo_links
            ),
        ),
    )


def _box(component: RtComponent, title: str) -> Box:
    ins = tuple(name for name, port in component.ports.items() if isinstance(port, InPort))
    outs = tuple(name for name in component.ports if name not in ins)
    return Box(component.instance_name, title or component.spec.type_name, ins, outs)
