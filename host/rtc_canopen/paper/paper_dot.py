"""A System Definition as a graph in the language of Graphviz, drawn without a bus."""

from __future__ import annotations

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.ports.data_port import InPort
from tickrig.host.rtc.system.dot import Box, Edge, write_dot
from tickrig.host.rtc_canopen.definition.definition import PdoName
from tickrig.host.rtc_canopen.paper.paper_check import check_on_paper
from tickrig.host.rtc_canopen.server import Server


def draw_on_paper(server: Server) -> str:
    """Return the graph: connections through the PC, and PDO links dashed.

    Args:
        server: it is of no other use any more, as after `check_on_paper`.
    """
    check_on_paper(server)
    entries = {node.id: node for node in server.definition.nodes}

    def port(name: PdoName) -> str:
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
