"""The non-volatile memory of slaves, kept in a JSON file."""

from __future__ import annotations

import json
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any, Final

from tickrig.device.canopen.dictionary import Dictionary, Entry
from tickrig.device.canopen.slave import UNCONFIGURED, Nonvolatile
from tickrig.host.text.log import log_of
from tickrig.host.text.whole_file import write_whole

_NODE_IDS: Final = (*range(1, 128), UNCONFIGURED)
FORMAT: Final = "tickrig CANopen store 1"

_log = log_of(__name__)


class StoreError(ValueError):
    """The file is not a store file; the file is not changed."""


class StoreFile:
    """A file that keeps the non-volatile memory of slaves between runs of the emulator.

    The file contains the data that slaves store by the object 1010h and by LSS. It is replaced as a
    whole, so it is never incomplete.

    Args:
        path: path of the file, which may be missing.

    Raises:
        StoreError: the file has another format, or is damaged.
        OSError: the file cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()
        self._nodes = _read(path)
        self._written = self._versions()

    def nonvolatile(self, name: str, dictionary: Dictionary) -> Nonvolatile:
        """Return the non-volatile memory of a node, as read from the file.

        The memory of a new node is empty. The node writes its stored values into this memory.
        If the EDS has changed, values that do not fit the dictionary are dropped.

        Args:
            name: name of the node.
            dictionary: the dictionary of the node.
        """
        memory = self._nodes.setdefault(name, Nonvolatile())
        self._written.setdefault(name, memory.version)
        for misfit in drop_misfits(memory, dictionary):
            _log.warning("%s: node %s: no room for %s", self.path, name, misfit)
        return memory

    def save(self) -> bool:
        """Write the file if a node has stored something since the file was last written.

        Returns:
            True if the file was written.

        Raises:
            OSError: the file cannot be written. The old file is kept.
        """
        versions = self._versions()
        if versions == self._written:
            return False
        write_whole(self.path, _format(self._nodes))
        self._written = versions
        return True

    def _versions(self) -> dict[str, int]:
        return {name: memory.version for name, memory in self._nodes.items()}


def _read(path: Path) -> dict[str, Nonvolatile]:
    try:
        content = json.loads(path.read_bytes())
    except FileNotFoundError:
        return {}
    except (ValueError, RecursionError) as error:
        raise StoreError(f"{path}: not a store file: {error}") from error
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise StoreError(f"{path}: not a store file: its format is not {FORMAT!r}")
    try:
        return {name: parse_memory(node) for name, node in content["nodes"].items()}
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise StoreError(f"{path}: a damaged store file: {error!r}") from error


def _multiplexer(key: int) -> str:
    return f"{key >> 8:04X}:{key & 0xFF:02X}"


def parse_memory(node: Mapping[str, Any]) -> Nonvolatile:
    """Return the non-volatile memory of a node from its entry in a store file.

    Raises:
        AttributeError, KeyError, TypeError, ValueError: the data are not in the format of
            `memory_values`.
    """
    parameters = {}
    for name, data in node["parameters"].items():
        index, sub = name.split(":")
        parameters[int(index, 16) << 8 | int(sub, 16)] = bytes.fromhex(data)
    program = node.get("program")
    return Nonvolatile(
        parameters,
        _number(node["node_id"], _NODE_IDS),
        _number(node["bit_rate_index"], range(10)),
        program=None if program is None else bytes.fromhex(program),
    )


def memory_values(memory: Nonvolatile) -> dict[str, Any]:
    """Return the stored data of a node as JSON values."""
    program = {} if memory.program is None else {"program": memory.program.hex().upper()}
    return {
        **program,
        "node_id": memory.node_id,
        "bit_rate_index": memory.bit_rate_index,
        "parameters": {
            _multiplexer(key): data.hex().upper() for key, data in sorted(memory.parameters.items())
        },
    }


def drop_misfits(memory: Nonvolatile, dictionary: Dictionary) -> list[str]:
    """Drop values that do not fit a dictionary; return their names, such as `1017:00`."""
    misfits = [
        key
        for key, data in memory.parameters.items()
        if not _fits(dictionary.find(key >> 8, key & 0xFF), data)
    ]
    for key in misfits:
        del memory.parameters[key]
    return [_multiplexer(key) for key in misfits]


def _fits(entry: Entry | None, data: bytes) -> bool:
    if entry is None:
        return False
    return len(data) == entry.size if entry.size else len(data) <= entry.description.max_bytes


def _number(value: object, allowed: Container[int]) -> int | None:
    if value is not None and (not isinstance(value, int) or value not in allowed):
        raise ValueError(f"{value!r} is out of range")
    return value


def _format(nodes: dict[str, Nonvolatile]) -> str:
    content = {
        "format": FORMAT,
        "nodes": {name: memory_values(memory) for name, memory in sorted(nodes.items())},
    }
    return json.dumps(content, indent=1) + "\n"
