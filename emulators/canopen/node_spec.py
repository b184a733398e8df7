"""Which nodes there shall be, as command lines and rig files say it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.emulators.refused import Refused, refuse_path

LSS: Final = "lss"
"""Instead of a node-ID: the node waits for LSS to give it one."""

_IDS: Final = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?")
_FIELDS: Final = frozenset({"id", "eds"})


@dataclass(frozen=True, slots=True)
class NodeSpec:
    """One node.

    Attributes:
        file: its EDS or DCF.
        node_id: 1..127, `UNCONFIGURED`, or None for that of the DCF.
    """

    file: Path
    node_id: int | None


def parse_node(text: str) -> Iterator[NodeSpec]:
    """Read `5=a.eds`, `1-20=a.eds`, `lss=a.eds` or `a.dcf`; Refused if it is none.

    >>> [spec.node_id for spec in parse_node("5-7=a.eds")]
    [5, 6, 7]
    """
    ids, equals, file = text.partition("=")
    if not equals:
        yield NodeSpec(Path(text), None)
        return
    if not file:
        raise Refused(f"--node {text}: give ID=FILE, as 5=a.eds")
    for node_id in parse_ids(f"--node {text}", ids):
        yield NodeSpec(Path(file), node_id)


def parse_ids(what: str, text: str) -> Iterable[int]:
    """Read a node-ID, a range of them, or `lss`."""
    if text == LSS:
        return (UNCONFIGURED,)
    match = _IDS.fullmatch(text)
    first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
    if not 1 <= first <= last <= 127:
        raise Refused(
            f"{what}: a node-ID is 1..127, a range as 1-20, or {LSS} for a node that waits for LSS"
        )
    return range(first, last + 1)


def read_rig(path: Path) -> Iterator[NodeSpec]:
    """Read a rig file: a table `[[node]]` with `id` and `eds` for each node, or more of a kind.

    Raises:
        Refused: the file cannot be used; the line says why.
    """
    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        refuse_path("rig", error)
    except ValueError as error:
        raise Refused(f"rig {path}: {error}") from None
    tables = content.pop("node", None)
    if content or not isinstance(tables, list):
        extra = f", not [{next(iter(content))}]" if content else ""
        raise Refused(f"rig {path}: it consists of tables [[node]]{extra}")
    for number, table in enumerate(tables, 1):
        yield from _read_table(path, f"rig {path}: node {number}", table)


def _read_table(path: Path, place: str, table: object) -> Iterator[NodeSpec]:
    if not isinstance(table, dict) or not set(table) <= _FIELDS:
        raise Refused(f"{place}: its keys are id and eds")
    node_id, file = table.get("id"), table.get("eds")
    if not isinstance(file, str) or not file:
        raise Refused(f"{place}: eds is the name of an EDS or DCF file")
    eds = path.parent / file
    if node_id is None:
        yield NodeSpec(eds, None)
        return
    for number in parse_ids(f"{place}: id {node_id!r}", str(node_id)):
        yield NodeSpec(eds, number)
