"""What is wrong between a System Definition and its EDS files, told without a bus."""

from __future__ import annotations

from collections.abc import Iterator

from tickrig.host.rtc.errors import RtcRefused
from tickrig.host.rtc_canopen.connections import are_there
from tickrig.host.rtc_canopen.definition.definition import PdoLink
from tickrig.host.rtc_canopen.definition.links import check_lengths, find_layout
from tickrig.host.rtc_canopen.errors import ServerRefused
from tickrig.host.rtc_canopen.paper.paper_boot import Layouts, boot_on_paper
from tickrig.host.rtc_canopen.proxy.proxy import ProxyRtc
from tickrig.host.rtc_canopen.server import Server


def check_on_paper(server: Server) -> tuple[str, ...]:
    """Return what will be refused on the bus, where devices are as their EDS says.

    A node whose EDS leaves values out is not judged, nor is a component that is not there.

    Args:
        server: it gets proxies of devices that are none, and is of no other use any more.
    """
    layouts = dict[int, Layouts]()
    for node_id, node in server.nodes.items():
        if (on := boot_on_paper(node.entry, node.file, node.writes)) is not None:
            layouts[node_id] = on
    return (
        *_proxies(server, layouts),
        *(text for link in server.definition.pdo_links for text in _link(link, layouts)),
        *_connections(server),
    )


def _proxies(server: Server, layouts: dict[int, Layouts]) -> Iterator[str]:
    for node_id, on in layouts.items():
        try:
            server.manager.add(ProxyRtc(server.nodes[node_id].entry, on))
        except RtcRefused as error:
            yield f"nodes: {error}"


def _link(link: PdoLink, layouts: dict[int, Layouts]) -> Iterator[str]:
    ends = [
        (name, layouts[name.node]) for name in (link.source, link.target) if name.node in layouts
    ]
    try:
        found = [find_layout(name, on) for name, on in ends]
        if len(found) == 2:
            check_lengths(link, *found)
    except ServerRefused as error:
        yield f"pdo_links: {error}"


def _connections(server: Server) -> Iterator[str]:
    for entry in server.definition.rt_connections:
        try:
            if are_there(server.manager, entry):
                server.manager.connect(entry.source, entry.target, entry.properties)
        except RtcRefused as error:
            yield f"rt_connections: {error}"
