"""Folders with a bus.yml and the EDS files that it names, and what dcfgen makes of them."""

from __future__ import annotations

import os
import struct
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import yaml

from tickrig.host.canopen.bus_file.bus_values import BusWrite

ROOT = Path(__file__).parents[4]
EPOS = (ROOT / "examples/eds/epos.eds").read_text("utf-8")
IO = (ROOT / "examples/io_module.eds").read_text("utf-8")

LAMP = (ROOT / "tests/host/canopen/bus_file/lamp.eds").read_text("utf-8")
SHEETS = {
    "epos.eds": EPOS,
    "io.eds": IO,
    "lamp.eds": LAMP,
    "lamp.dcf": f"{LAMP}[DeviceComissioning]\nNodeID=9\n",
    "broken.eds": LAMP.replace("DefaultValue=0x0000000A", "DefaultValue=ten"),
    "other.eds": LAMP.replace("VendorNumber=0x0000000A", "VendorNumber=0x0000000B"),
    "counted.eds": LAMP.replace("NrOfRXPDO=0", "CompactPDO=0x3F\nNrOfRXPDO=2"),
    "bare.eds": LAMP.replace("1018", "2018"),
}
"""The EDS and DCF files beside a bus.yml, by name."""

MASTER = "master: {node_id: 1}\n"
NODE = MASTER + "axis:\n  node_id: 5\n  dcf: epos.eds\n"
"""A file with one node, to which keys may be added."""


def write_bus(folder: Path, text: str) -> Path:
    """Write a bus.yml and the EDS files beside it."""
    for name, eds in SHEETS.items():
        (folder / name).write_text(eds, "utf-8")
    path = folder / "bus.yml"
    path.write_text(text, "utf-8")
    return path


def entry_of(write: BusWrite) -> bytes:
    """Return an entry of a concise DCF (CiA 302-3)."""
    return struct.pack("<HBL", write.index, write.sub_index, len(write.data)) + write.data


def concise_dcf(writes: Iterable[BusWrite]) -> bytes:
    """Return a concise DCF (1F22h): how many entries, and the entries."""
    entries = [entry_of(write) for write in writes]
    return struct.pack("<L", len(entries)) + b"".join(entries)


class Pdo(NamedTuple):
    """A PDO of the master's dictionary."""

    number: int
    transmit: bool
    cob_id: int
    transmission: int
    mapping: tuple[tuple[int, int, int], ...]


class Generated(NamedTuple):
    """What dcfgen makes of a file: values of its slaves by name, and its warnings."""

    slaves: dict[str, Any]
    master: Any
    warnings: list[str]


def generate(path: Path) -> Generated:
    """Let dcfgen of Lely read a file; the file is expanded as cogen of ros2_canopen does it.

    Raises:
        Exception: whatever dcfgen dies of.
    """
    cli = _dcfgen()
    text = path.read_text("utf-8").replace("@BUS_CONFIG_PATH@", str(path.parent))
    config = _expanded(yaml.safe_load(text))
    options = {
        "cob_id": 0x680,
        "dcf_path": "",
        "heartbeat_multiplier": 3.0,
        "retry_factor": 3,
        **config.get("options", {}),
    }
    with _within(path.parent), warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        slaves = {}
        for name in config:
            if name not in {"options", "master"} and not name.startswith("."):
                slave = cli.Slave.from_config(name, config[name], options, _NotStrict)
                if slave.node_id != 255:
                    slaves[name] = slave
        master = cli.Master.from_config(config["master"], options, slaves)
    return Generated(
        slaves, master, [str(one.message) for one in said if one.category is UserWarning]
    )


class _NotStrict:
    """The option -S, with which ros2_canopen calls dcfgen."""

    no_strict = True


def _dcfgen() -> Any:
    """Import dcfgen; pkg_resources, which it asks for its template only, may be gone."""
    stand_in = ModuleType("pkg_resources")
    sys.modules.setdefault("pkg_resources", stand_in)
    try:
        return import_module("dcfgen.cli")
    finally:
        if sys.modules["pkg_resources"] is stand_in:  # pytest asks for it, too
            del sys.modules["pkg_resources"]


@contextmanager
def _within(folder: Path) -> Iterator[None]:
    """Work in a folder, as the build of ros2_canopen calls dcfgen there."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _expanded(config: Any) -> Any:
    """Return a file as cogen writes it: defaults in all nodes, keys sorted."""
    if "nodes" not in config:
        return config
    nodes = config["nodes"]
    for node in nodes.values():
        node.update(config.get("defaults", {}))
    whole = {"options": config.get("options", {}), "master": config["master"], **nodes}
    return yaml.safe_load(yaml.dump(whole))
