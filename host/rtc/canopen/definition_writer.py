"""Write a System Definition in the format of `parse_definition`. Default values are left out."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, asdict, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from tickrig.host.rtc.canopen.definition import (
    NodeEntry,
    PdoEntry,
    PdoLink,
    Role,
    RtConnection,
    SdoEntry,
    SdoPortEntry,
    SystemDefinition,
)
from tickrig.host.text.whole_file import write_whole

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_Table = dict[str, Any]


class _Hex(int):
    """A number that is written as 0x..."""


class _Dumper(yaml.SafeDumper):
    """Dumper that writes `_Hex` as such, and repeats values in place of anchors."""

    def ignore_aliases(self, data: object) -> bool:
        """Write no anchors."""
        return True


def _represent_hex(dumper: _Dumper, value: _Hex) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:int", f"0x{value:X}")


def _represent_role(dumper: _Dumper, role: Role) -> yaml.ScalarNode:
    return dumper.represent_str(role.value)


_Dumper.add_representer(_Hex, _represent_hex)
_Dumper.add_representer(Role, _represent_role)


def save_definition(definition: SystemDefinition, folder: Path, path: Path) -> None:
    """Save a System Definition as a file. If that fails, an existing file is kept unchanged.

    Args:
        definition: System Definition to save.
        folder: folder to which the paths of the EDS files in the definition are relative.
        path: path of the file. In the file, the paths of EDS files are relative to its folder.

    Raises:
        OSError: the file cannot be written.
    """
    nodes = tuple(_seen_from(node, folder, path.parent) for node in definition.nodes)
    write_whole(path, write_definition(replace(definition, nodes=nodes)))


def write_definition(definition: SystemDefinition) -> str:
    """Return a System Definition as text for a file."""
    content = {name: value for name, value in _sections(definition) if value}
    return yaml.dump(
        content,
        Dumper=_Dumper,
        default_flow_style=None,
        sort_keys=False,
        width=98,
        allow_unicode=True,
    )


def _sections(definition: SystemDefinition) -> Iterator[tuple[str, _Table | list[_Table]]]:
    yield "bus", _changed(definition.bus)
    yield "master", _changed(definition.master)
    yield "nodes", [_node(node) for node in definition.nodes]
    yield "sdo", [_sdo(entry) for entry in definition.sdo]
    yield "pdo_links", [_link(link) for link in definition.pdo_links]
    yield "rt_connections", [_rt_connection(entry) for entry in definition.rt_connections]
    yield "start", _changed(definition.start)


def _changed(value: DataclassInstance) -> _Table:
    """Return the fields whose values are not the default, by their keys in the file."""
    return {
        item.metadata.get("key", item.name): getattr(value, item.name)
        for item in fields(value)
        if getattr(value, item.name) != _default(item)
    }


def _default(item: Field[Any]) -> object:
    return item.default if item.default_factory is MISSING else item.default_factory()


def _node(node: NodeEntry) -> _Table:
    values = _changed(node)
    if node.ports:
        values["ports"] = dict(node.ports)
    if node.sdo_ports:
        values["sdo_ports"] = {name: _sdo_port(port) for name, port in node.sdo_ports.items()}
    if node.pdos:
        values["pdos"] = {name: _pdo(pdo) for name, pdo in node.pdos.items()}
    return values


def _pdo(pdo: PdoEntry) -> _Table:
    values = _changed(pdo)
    if pdo.mapping is not None:
        values["mapping"] = [_Hex(entry.encode()) for entry in pdo.mapping]
    if pdo.cob_id is not None:
        values["cob_id"] = _Hex(pdo.cob_id)
    return values


def _sdo_port(entry: SdoPortEntry) -> _Table:
    values: _Table = {"index": _Hex(entry.index), "direction": entry.direction.value}
    return values if entry.type is None else {**values, "type": entry.type}


def _sdo(entry: SdoEntry) -> _Table:
    return {**asdict(entry), "index": _Hex(entry.index)}


def _link(link: PdoLink) -> _Table:
    return {"from": str(link.source), "to": str(link.target)}


def _rt_connection(entry: RtConnection) -> _Table:
    ends: Mapping[str, object] = {"from": entry.source, "to": entry.target}
    return {**ends, "properties": dict(entry.properties)} if entry.properties else {**ends}


def _seen_from(node: NodeEntry, folder: Path, other: Path) -> NodeEntry:
    if Path(node.eds).is_absolute() or folder.resolve() == other.resolve():
        return node
    return replace(node, eds=os.path.relpath((folder / node.eds).resolve(), other.resolve()))
