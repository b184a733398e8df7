"""Nodes as lines with styles: a board with a row for each, and a card of one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from textwrap import wrap
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.board_text import emcy_history
from tickrig.host.canmon.model.decode.node_board import NodeStatus
from tickrig.host.canmon.model.views.node_card import identity_words, maker_text, pdo_contents
from tickrig.host.tui.line_view import Line, line_width, plain
from tickrig.wire.canopen.emcy import describe
from tickrig.wire.canopen.nmt import NmtState

GOOD: Final = "bold green"
WARNING: Final = "yellow"
BAD: Final = "bold red"
DIM: Final = "dim"
HEAD: Final = "bold"
STATE_STYLES: Final[dict[int | None, str]] = {
    NmtState.OPERATIONAL: GOOD,
    NmtState.PRE_OPERATIONAL: WARNING,
    NmtState.STOPPED: "magenta",
}
FULL, EMPTY = "█", "░"
GAP: Final = "  "
MIDDLE, WIDE = 110, 160
"""From so many columns on, the board has more of them."""
LEAST_ERRORS: Final = 12


class Column(NamedTuple):
    """A column of the board.

    Attributes:
        title: its head.
        cell: what it says of a node at a time, in a board so wide.
        least: it is there from so many columns of the screen on.
        most: characters; what is longer is cut.
        kept: it is there even if it says nothing of any node.
    """

    title: str
    cell: Callable[[NodeStatus, int, int], Line]
    least: int = 0
    most: int = 40
    kept: bool = False


def board_lines(rows: Sequence[NodeStatus], now_us: int, width: int) -> list[Line]:
    """Return a head, and a line for each node, as wide as the screen where there is so much.

    Args:
        rows: the nodes.
        now_us: the time for which ages are told.
        width: columns of the screen.
    """
    several = len({row.channel for row in rows}) > 1
    tables = [(column, _cells(column, rows, now_us, width)) for column in _columns(several, width)]
    used = [one for one in tables if one[0].kept or any(map(line_width, one[1]))]
    widths = _widths(used, width)
    head = GAP.join(
        f"{column.title:<{wide}.{wide}}" for (column, _), wide in zip(used, widths, strict=True)
    )
    return [plain(head.rstrip(), HEAD), *_joined([cells for _, cells in used], widths)]


def _columns(several: bool, width: int) -> list[Column]:
    node = _bus_node if several else _node
    return [Column("NODE", node, kept=True), *(one for one in COLUMNS if one.least <= width)]


def _cells(column: Column, rows: Sequence[NodeStatus], now_us: int, width: int) -> list[Line]:
    return [column.cell(row, now_us, width) for row in rows]


def _widths(used: Sequence[tuple[Column, Sequence[Line]]], width: int) -> list[int]:
    """Return the width of each column; the last one has what is left."""
    widths = [
        min(column.most, max(len(column.title), *map(line_width, cells), 0))
        for column, cells in used
    ]
    left = width - sum(widths[:-1]) - len(GAP) * (len(widths) - 1)
    widths[-1] = max(LEAST_ERRORS, left)
    return widths


def _joined(columns: Sequence[Sequence[Line]], widths: Sequence[int]) -> Iterator[Line]:
    for cells in zip(*columns, strict=True):
        pieces: list[tuple[str, str]] = []
        for cell, width in zip(cells, widths, strict=True):
            pieces += [*cut(cell, width), (" " * (width - min(width, line_width(cell))) + GAP, "")]
        yield tuple(pieces[:-1])


def cut(line: Line, width: int) -> Line:
    """Return a line of at most so many characters; what is cut ends with an ellipsis.

    >>> cut((("pre-", "bold"), ("operational", "")), 8)
    (('pre-', 'bold'), ('ope…', ''))
    """
    if line_width(line) <= width:
        return line
    pieces: list[tuple[str, str]] = []
    left = width - 1
    for text, style in line:
        if left <= len(text):
            return (*pieces, (text[:left] + "…", style))
        pieces.append((text, style))
        left -= len(text)
    return tuple(pieces)


def _node(row: NodeStatus, now_us: int, width: int) -> Line:
    return plain(str(row.node), HEAD)


def _bus_node(row: NodeStatus, now_us: int, width: int) -> Line:
    return plain(f"{row.channel} {row.node}", HEAD)


def _state(row: NodeStatus, now_us: int, width: int) -> Line:
    if row.is_late(now_us):
        return plain(row.state_text, BAD)
    return plain(row.state_text, STATE_STYLES.get(row.state, DIM))


def heartbeat_line(row: NodeStatus, now_us: int, width: int) -> Line:
    """Write how old the heartbeat is: a bar that is full after a period, and numbers."""
    age_us, period_us = row.age_us(now_us), row.period_us
    if age_us is None:
        return plain("never heard", BAD) if period_us else ()
    if period_us is None:
        return plain(f"none, {age_us / 1e6:.1f} s ago", DIM)
    cells = 6 if width < MIDDLE else 12 if width < WIDE else 16
    full = min(cells, max(0, age_us) * cells // period_us)
    late = row.is_late(now_us)
    style = BAD if late else WARNING if age_us > period_us else "green"
    about = "~" if row.learnt else ""
    age = f"{age_us // 1_000}" if age_us < 10_000_000 else f"{age_us // 1_000_000} s"
    text = f" {age}/{about}{period_us // 1_000} ms" + " LATE" * late
    bar = (FULL * full, style), (EMPTY * (cells - full), DIM)
    return tuple(one for one in (*bar, (text, style if late else "")) if one[0])


def _boots(row: NodeStatus, now_us: int, width: int) -> Line:
    return plain(f"{row.boots}", WARNING if row.unrequested_boots else "") if row.boots else ()


def error_line(row: NodeStatus, now_us: int, width: int) -> Line:
    """Say in words what is wrong with a node, the worst first; empty for nothing."""
    pieces = []
    if row.error_code:
        pieces.append((f"{row.error_code:04X}h {describe(row.error_code)}", BAD))
    if row.unrequested_boots:
        pieces.append((f"{row.unrequested_boots} boot-up unasked", WARNING))
    if row.sdo_errors:
        pieces.append((f"SDO {row.sdo_error}", WARNING))
    if row.late:
        pieces.append((f"{row.late} late", WARNING))
    if row.emcy_count and not row.error_code:
        pieces.append((f"{row.emcy_count} EMCY, gone", DIM))
    return tuple(piece for one in pieces for piece in (one, ("; ", "")))[:-1]


def _carried(row: NodeStatus, now_us: int, width: int) -> Line:
    sent = [name for pdo in pdo_contents(row) if not pdo.receives for name in pdo.names]
    return plain(", ".join(name.rpartition(".")[2] for name in sent))


COLUMNS: Final = (
    Column("NAME", lambda row, now_us, width: plain(row.name), most=24),
    Column("MAKER", lambda row, now_us, width: plain(maker_text(row)), WIDE, 20),
    Column("NMT STATE", _state, kept=True),
    Column("HEARTBEAT", heartbeat_line, kept=True),
    Column("BOOT-UPS", _boots, WIDE),
    Column("DRIVE", lambda row, now_us, width: plain(row.drive_state), MIDDLE, 22),
    Column("TPDOs CARRY", _carried, WIDE, 34),
    Column("ERRORS", error_line, kept=True),
)


INDENT: Final = 10


def card_lines(row: NodeStatus, rows: Sequence[NodeStatus], width: int) -> list[Line]:
    """Return what is known of one node, and the EMCYs of all, the latest first.

    Args:
        row: the node.
        rows: all nodes.
        width: columns of the screen; what is longer goes on in the next line.
    """
    where = f"{row.channel} node {row.node}" + f": {row.name}" * bool(row.name)
    lines = [plain(where, HEAD)]
    lines += _wrapped("device", identity_words(row), width)
    for pdo in pdo_contents(row):
        lines += _wrapped(f"{pdo.kind.upper()} {pdo.can_id:03X}h", pdo.text, width)
    if row.drive_state:
        lines += _wrapped("drive", row.drive_state, width)
    if row.sdo_errors:
        lines += _wrapped("SDO", f"{row.sdo_errors} failed, the latest: {row.sdo_error}", width)
    history = emcy_history(rows)
    heads = [plain(line, HEAD) for line in history[:2]]
    return [*lines, *heads, *(part for line in history[2:] for part in _wrapped("", line, width))]


def _wrapped(title: str, text: str, width: int) -> list[Line]:
    indent = INDENT + 3 if title else 0
    parts = wrap(text, max(20, width - indent), subsequent_indent="" if title else " " * 10)
    first = (f"  {title:<{INDENT}} ", DIM) if title else ("", "")
    rest = (" " * indent, "")
    return [((rest if number else first), (part, "")) for number, part in enumerate(parts or [""])]
