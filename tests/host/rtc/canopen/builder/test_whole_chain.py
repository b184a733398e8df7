"""From a profile to a component that the server activates, through the files alone."""

from __future__ import annotations

from pathlib import Path

from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import describe_nodes, make_nodes
from tickrig.emulators.canopen.node_spec import parse_node
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.rtc.canopen.builder.build import build
from tickrig.host.rtc.canopen.builder.profile_file import EXAMPLE, parse_project
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.serve import read_files, serve
from tickrig.host.rtc.canopen.server import RtcCanopenServer


def test_the_server_activates_what_the_builder_wrote(tmp_path: Path) -> None:
    for name, text in build(parse_project(EXAMPLE)).items():
        (tmp_path / name).write_text(text, "utf-8")
    wire = CanWire()
    (node,) = make_nodes(describe_nodes(parse_node(f"16={tmp_path / 'gripper.py'}:Gripper")), wire)
    link = CanHost(Rig(Station(node, node.port)), wire.end())
    definition = parse_definition((tmp_path / "gripper.yaml").read_text("utf-8"))
    server = RtcCanopenServer(definition, read_files(definition, tmp_path))
    serve(server, link, 1_000_000)
    proxy = server.nodes[16].proxy
    assert proxy is not None
    assert sorted(proxy.ports) == ["forces_mn", "target_um"]
    server.manager.activate("Gripper0")
    serve(server, link, 1_400_000)
    assert (node.read("rtc_state"), proxy.state.name) == ("Active", "ACTIVE")
