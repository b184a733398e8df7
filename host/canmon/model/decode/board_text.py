"""The node board as lines of text, and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from tickrig.host.canmon.model.decode.node_board import NodeBoard, NodeStatus
from tickrig.host.text.page_text import json_text
from tickrig.wire.canopen.emcy import describe

VERSION: Final = 1
GAP: Final = "  "
BAR_CELLS: Final = 5
HEADS: Final = ("NODE", "NAME", "NMT STATE", "HEARTBEAT", "BOOT-UPS", "DRIVE", "EMCY", "SDO ERROR")


def render_board(board: NodeBoard, now_us: int, width: int, height: int) -> list[str]:
    """Return the board as lines: a table, and below it the latest EMCYs.

    Args:
        board: the board.
        now_us: the time for which ages are told.
        width: columns of the terminal.
        height: lines that may be used.
    """
    rows = board.rows()
    several = len({row.channel for row in rows}) > 1
    cells = [HEADS, *(_cells(row, now_us, with_bus=several) for row in rows)]
    used = [column for column in range(len(HEADS)) if any(line[column] for line in cells[1:])]
    widths = {column: max(len(line[column]) for line in cells) for column in used}
    lines = [GAP.join(line[column].ljust(widths[column]) for column in used) for line in cells]
    if not rows:
        lines = ["no node was heard"]
    lines += emcy_history(rows)
    return [_cut(line.rstrip(), width) for line in lines[:height]]


def board_json(board: NodeBoard, now_us: int) -> list[str]:
    """Return one JSON object a node."""
    return [json_text(_fields(row, now_us)) for row in board.rows()]


def _cells(row: NodeStatus, now_us: int, *, with_bus: bool) -> tuple[str, ...]:
    boots = (
        f"{row.boots} ({row.unrequested_boots} unasked)"
        if row.unrequested_boots
        else f"{row.boots}"
    )
    return (
        f"{row.channel} {row.node}" if with_bus else str(row.node),
        row.name,
        row.state_text,
        _heartbeat(row, now_us),
        boots if row.boots else "",
        row.drive_state,
        _emcy(row),
        f"{row.sdo_error} [{row.sdo_errors}]" if row.sdo_errors else "",
    )


def _heartbeat(row: NodeStatus, now_us: int) -> str:
    """Write age, period, and how much of one and a half periods has gone."""
    age_us, period_us = row.age_us(now_us), row.period_us
    if age_us is None:
        return "never heard" if row.period_us else ""
    if period_us is None:
        return f"{age_us // 1_000} ms ago"
    share = min(BAR_CELLS, age_us * BAR_CELLS * 2 // (3 * period_us))
    bar = "#" * share + "." * (BAR_CELLS - share)
    about = "~" if row.learnt else ""
    words = [f"{bar} {age_us // 1_000}/{about}{period_us // 1_000} ms"]
    words += ["LATE"] if row.is_late(now_us) else []
    words += [f"late so far: {row.late}"] if row.late else []
    return " ".join(words)


def _emcy(row: NodeStatus) -> str:
    if not row.emcy_count:
        return ""
    now = f"{row.error_code:04X}h {describe(row.error_code)}" if row.error_code else "gone"
    return f"{now} [{row.emcy_count}]"


def emcy_history(rows: Sequence[NodeStatus]) -> list[str]:
    """Return an empty line, a head, and the EMCYs of all nodes, the latest first; or nothing."""
    found = sorted((emcy.at_us, row.node, emcy.text) for row in rows for emcy in row.emcys)
    lines = [f"{at_us / 1e6:.6f}  node {node}  {text}" for at_us, node, text in reversed(found)]
    return ["", "EMCY, latest first", *lines] if lines else []


def _cut(line: str, width: int) -> str:
    return line if len(line) <= width else line[: width - 1] + "…"


def _fields(row: NodeStatus, now_us: int) -> dict[str, object]:
    age_us, period_us = row.age_us(now_us), row.period_us
    return {
        "v": VERSION,
        "ev": "node",
        "t": now_us / 1e6,
        "ch": row.channel,
        "node": row.node,
        "name": row.name,
        "state": row.state_text,
        "heartbeat_ms": None if period_us is None else period_us / 1_000,
        "learnt": row.learnt,
        "age_ms": None if age_us is None else age_us / 1_000,
        "late": row.is_late(now_us),
        "late_count": row.late,
        "boots": row.boots,
        "unasked_boots": row.unrequested_boots,
        "drive": row.drive_state,
        "error_code": row.error_code,
        "emcy": [{"t": e.at_us / 1e6, "code": e.code, "text": e.text} for e in row.emcys],
        "sdo_errors": row.sdo_errors,
        "sdo_error": row.sdo_error,
    }
