"""System Definitions in files."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from tickrig.host.rtc_canopen.definition.definition import NodeEntry, SystemDefinition
from tickrig.host.rtc_canopen.definition.definition_reader import parse_definition
from tickrig.host.rtc_canopen.definition.definition_writer import write_definition
from tickrig.host.rtc_canopen.errors import DefinitionError


def read_definition(path: Path) -> SystemDefinition:
    """Read a System Definition.

    Raises:
        OSError: the file cannot be read.
        DefinitionError: it cannot be used; the line says where and why.
    """
    try:
        return parse_definition(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise DefinitionError(f"{path}: byte {error.start} is not UTF-8") from error
    except ValueError as error:
        raise DefinitionError(f"{path}: {error}") from error


def save_definition(definition: SystemDefinition, folder: Path, path: Path) -> None:
    """Write a System Definition; the file is there whole or as it was.

    Args:
        definition: what is written.
        folder: where its EDS files are seen from.
        path: the file; EDS files are seen from its folder then.

    Raises:
        OSError: the file cannot be written.
    """
    nodes = tuple(_seen_from(node, folder, path.parent) for node in definition.nodes)
    text = write_definition(replace(definition, nodes=nodes))
    beside = path.with_name(f".{path.name}.new")
    try:
        beside.write_text(text, "utf-8")
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def _seen_from(node: NodeEntry, folder: Path, other: Path) -> NodeEntry:
    if Path(node.eds).is_absolute() or folder.resolve() == other.resolve():
        return node
    return replace(node, eds=os.path.relpath((folder / node.eds).resolve(), other.resolve()))
