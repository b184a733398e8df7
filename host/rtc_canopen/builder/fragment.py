"""The node of a DeviceRTC in a System Definition (DECISION K16)."""

from __future__ import annotations

from tickrig.host.rtc_canopen.builder.names import snake_name
from tickrig.host.rtc_canopen.builder.profile_file import Project
from tickrig.host.rtc_canopen.definition.definition import NodeEntry, SystemDefinition
from tickrig.host.rtc_canopen.definition.definition_writer import write_definition
from tickrig.wire.rtc_canopen.profile import Direction, PlacedPort


def write_fragment(project: Project) -> str:
    """Return a System Definition that has this node alone; its ports keep their names."""
    profile = project.profile
    node = NodeEntry(
        project.node_id,
        f"{profile.type_name}0",
        f"{snake_name(profile.type_name)}.eds",
        ports={pdo_name(port): port.profile.name for port in profile.placed()},
    )
    return write_definition(SystemDefinition((node,)))


def pdo_name(port: PlacedPort) -> str:
    """Return what a System Definition calls the PDO of a port: `tpdo1`, `rpdo1`."""
    kind = "rpdo" if port.profile.direction is Direction.IN else "tpdo"
    return f"{kind}{port.number}"
