"""Rig files: which nodes there shall be, and the body that they move."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tickrig.emulators.canopen.body import BodySpec, read_body
from tickrig.emulators.canopen.choices import MODELS, PROFILES
from tickrig.emulators.canopen.node_spec import NodeSpec, parse_ids
from tickrig.host.canopen.bus_file.bus_file import is_bus_file
from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.text.toml_reader import load_toml
from tickrig.host.text.user_file import SUFFIX

NODE_KEYS: Final = ("id", "eds", "model", "rtc", "profile")
DEVICE_KEYS: Final = ("eds", "model", "rtc")
_TABLES: Final = "it consists of tables [[node]] and perhaps one table [body]"


@dataclass(frozen=True, slots=True)
class RigFile:
    """What a rig file says.

    Attributes:
        nodes: the nodes.
        body: what they move, None if nothing.
    """

    nodes: tuple[NodeSpec, ...]
    body: BodySpec | None = None


def read_rig(path: Path) -> RigFile:
    """Read a rig file.

    Raises:
        Refused: the file cannot be used; the line says where and why.
    """
    try:
        text = path.read_text("utf-8")
        if is_bus_file(text.encode()):
            raise Refused(f"rig {path}: it is a bus.yml: --bus {path}")
        content = load_toml(text)
    except OSError as error:
        refuse_path("rig", error)
    except ValueError as error:
        raise Refused(f"rig {path}: {error}") from None
    tables, body = content.pop("node", None), content.pop("body", None)
    if "device" in content:
        raise Refused(f"rig {path}: it describes a bench: tickrig run {path}")
    if content or not isinstance(tables, list):
        extra = f", not [{next(iter(content))}]" if content else ""
        raise Refused(f"rig {path}: {_TABLES}{extra}")
    nodes = [
        spec
        for number, table in enumerate(tables, 1)
        for spec in _read_node(path, f"rig {path}: node {number}", table)
    ]
    return RigFile(tuple(nodes), None if body is None else read_body(f"rig {path}: body", body))


def _read_node(path: Path, place: str, table: object) -> Iterator[NodeSpec]:
    if not isinstance(table, dict):
        raise Refused(f"{place}: it is a table with the keys {', '.join(NODE_KEYS)}")
    if unknown := [key for key in table if key not in NODE_KEYS]:
        raise Refused(f"{place}: no key {unknown[0]}; known: {', '.join(NODE_KEYS)}")
    device, profile = _device(path, place, table), table.get("profile")
    if profile is not None and profile not in PROFILES:
        raise Refused(f"{place}: profile {profile!r} is not one of {', '.join(PROFILES)}")
    node_id = table.get("id")
    if node_id is None:
        yield NodeSpec(device, None, profile)
        return
    for number in parse_ids(f"{place}: id {node_id!r}", str(node_id)):
        yield NodeSpec(device, number, profile)


def _device(path: Path, place: str, table: dict[str, Any]) -> Path | str:
    """Return what the node is made of; files are looked for beside the rig file."""
    given = [key for key in DEVICE_KEYS if key in table]
    if len(given) != 1:
        raise Refused(f"{place}: give eds, the name of an EDS or DCF file, or model, or rtc")
    key, name = given[0], table[given[0]]
    if key != "eds" and "profile" in table:
        raise Refused(f"{place}: profile belongs to eds; each {key} has its own")
    if key == "model" and (not isinstance(name, str) or name not in MODELS):
        raise Refused(f"{place}: model {name!r} is not one of {', '.join(MODELS)}")
    if key == "rtc" and not (isinstance(name, str) and f"{SUFFIX}:" in name):
        raise Refused(f"{place}: rtc {name!r} is not FILE{SUFFIX}:Class")
    if not isinstance(name, str) or not name:
        raise Refused(f"{place}: eds {name!r} is not the name of an EDS or DCF file")
    if key == "model":
        return name
    return path.parent / name if key == "eds" else str(path.parent / name)
