"""Components as boxes and connectors as wires, drawn with box characters.

>>> boxes = [Box("A0", "Adder", (), ("out",), "ACTIVE"), Box("B0", "", ("in",), (), "INACTIVE")]
>>> for line in draw(boxes, [Edge("A0.out", "B0.in")], 40).lines:
...     print("".join(text for text, _ in line))
┌ A0 ──────────┐   ┌ B0 ──────┐
│              │ ┌─▶in        │
│           out├─┘ └ Inactive ┘
└ Adder Active ┘
"""

# Theory of operation
#
# The picture is a grid. The column of a box is one further right than the boxes that feed it
# (`_layers`; wires that close a loop do not count). If the screen has fewer columns than there are
# layers, the next layers begin below, at the left. Boxes without wires come last.
#
# Between two columns there is a channel, between two rows a street:
#
#       channel 0   column 0   channel 1   column 1   channel 2
#   street 0
#   row 0           [ box ]                [ box ]
#   street 1
#   row 1           [ box ]                [ box ]
#   street 2
#
# A wire has straight pieces only. It leaves its port sideways into the adjacent channel and runs in
# a lane of that channel. If the other port is at the same channel, the lane ends at this port. Else
# the lane leads to a street, a track of the street leads to the channel of the other port, and a
# lane of that channel leads to the port. Two wires never share a piece of a lane or track, so where
# they meet they cross (`┼`). This follows from two rules:
#
#   - In ports are on even lines of a box, out ports on odd ones. All boxes of a row begin on one
#     line, so a wire that leaves a column and one that enters the next are never on one line. If
#     the facing box has no ports on its side, a box with ports at one side has one on each line.
#   - A wire occupies an interval of the lines of a lane, or of the channels of a track. Lanes and
#     tracks are assigned so that no two intervals on one lane or track overlap (`_packed`).
#
# Each step needs the results of the steps before it: first the tracks from the channels, then the
# heights of streets, then the lines of rows and ports, then the lanes from the lines, then the
# widths of channels and all columns. Wires of one port share the piece next to the port.
#
# Columns are cells of a terminal; a wide character takes two. Names come from other people's
# systems. So control characters and characters without a cell are replaced before names are
# measured.

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Final, NamedTuple

from rich.cells import cell_len

from tickrig.host.rtc.editor.styles import DIM, LIT, STATES
from tickrig.host.rtc.system.dot import Box, Edge
from tickrig.host.text.page_text import in_cells

_Line = tuple[tuple[str, str], ...]
"""Pieces of text with their styles, as `LineView` takes them."""

_MOST_BOX: Final = 26
_LEAST_BOX: Final = 9
"""Largest and least width of a box with its frame in cells."""

_FRAMES: Final = {"ACTIVE": "green", "INACTIVE": "cyan", "ERROR": "bold red"}
_WIRE: Final = "green"
_PAST_PC: Final = "magenta"
_NAME: Final = "bold"

_NORTH, _EAST, _SOUTH, _WEST = 1, 2, 4, 8
_SIGNS: Final = "?│─└││┌├─┘─┴┐┤┬┼"
"""Characters by the sides to which wires go. The index is the sum of the four numbers above."""

_DASHED: Final = {"│": "╎", "─": "╌"}
_ELSEWHERE: Final = "elsewhere"


class _Place(NamedTuple):
    """The place of an item in a picture, in lines and cells."""

    line: int
    column: int
    width: int


class Picture(NamedTuple):
    """A system drawn as text for a terminal, with boxes for components and lines for connectors.

    Attributes:
        lines: lines of the drawing, with styles.
        places: positions of boxes by name, and of ports by full name.
    """

    lines: tuple[_Line, ...]
    places: Mapping[str, _Place]

    @property
    def width(self) -> int:
        """Number of cells of the widest line."""
        return max((sum(cell_len(text) for text, _ in line) for line in self.lines), default=0)


def draw(
    boxes: Iterable[Box],
    edges: Iterable[Edge],
    columns: int,
    lit: Mapping[str, str] | None = None,
) -> Picture:
    """Draw a system as text for a terminal.

    Args:
        boxes: components of the system.
        edges: connectors of the system. If `boxes` lacks the component of a port, this component
            gets an additional box.
        columns: width of the screen in cells. If the drawing would be wider, all boxes are in one
            column.
        lit: styles of highlighted boxes and ports, by name. The line of a connector has the style
            of its highlighted port.
    """
    wires = [replace(one, source=_key(one.source), target=_key(one.target)) for one in edges]
    return _fitting(tuple(boxes), tuple(dict.fromkeys(wires)), columns).paint(lit or {})


def _key(port: str) -> str:
    """Return a full name in the form of keys, which is `A0.out`, also for `A0:out`."""
    return ".".join(_split(port))


@lru_cache(maxsize=4)  # the cursor moves more often than the system changes
def _fitting(boxes: tuple[Box, ...], wires: tuple[Edge, ...], columns: int) -> _Layout:
    """Return the layout with the most columns of boxes that fits, or else the narrowest layout."""
    all_boxes = _with_others(list(boxes), wires)
    layouts = (
        _Layout(all_boxes, wires, count, gap, columns)
        for count in range(max(1, columns // (_LEAST_BOX + 1)), 0, -1)
        for gap in (2, 1)
    )
    tried = list[_Layout]()
    for layout in layouts:
        if layout.width <= columns:
            return layout
        tried.append(layout)
    return min(tried, key=lambda layout: layout.width)


def neighbour(places: Mapping[str, _Place], name: str, right: int, down: int) -> str:
    """Return the box or port to which an arrow key moves the cursor. It may be the present one.

    Args:
        places: positions of the boxes and ports of a picture, by name.
        name: name of the box or port under the cursor.
        right: step to the right: 1 for right, -1 for left, or 0.
        down: step down: 1 for down, -1 for up, or 0.
    """
    at = places[name]

    def cost(other: _Place) -> int:
        lines, cells = other.line - at.line, other.column - at.column
        along, across = (lines * down, abs(cells)) if down else (cells * right, 4 * abs(lines))
        return along + 2 * across if along > 0 else 0

    costs = {other: cost(place) for other, place in places.items() if cost(place)}
    if right:  # sideways go ports, and boxes only if there is no port
        costs = {one: costs[one] for one in costs if one.rpartition(".")[0] in places} or costs
    return min(costs, key=lambda one: costs[one], default=name)


def _shown(name: str, width: int) -> str:
    r"""Return a name as text of `width` cells. A cut name ends with `…`.

    >>> _shown("ロボット0", 6), _shown("a\x1b[1m\u0301b", 20)
    ('ロボ…', 'a␛[1m�b')
    """
    text = "".join(one if cell_len(one) else "�" for one in in_cells(name))
    if cell_len(text) <= width:
        return text
    while text and cell_len(text) >= width:
        text = text[:-1]
    return f"{text}…" if width > 0 else ""


def _with_others(boxes: list[Box], wires: Sequence[Edge]) -> list[Box]:
    """Return the boxes, and a box for each component that only wires name."""
    ports = {f"{box.name}.{port}" for box in boxes for port in (*box.ins, *box.outs)}
    ins, outs = defaultdict[str, list[str]](list), defaultdict[str, list[str]](list)
    for wire in wires:
        for end, side in ((wire.source, outs), (wire.target, ins)):
            owner, port = _split(end)
            if end not in ports and port not in (*ins[owner], *outs[owner]):
                side[owner].append(port)
    for number, box in enumerate(boxes):
        more_ins, more_outs = ins.pop(box.name, []), outs.pop(box.name, [])
        boxes[number] = Box(
            box.name, box.title, (*box.ins, *more_ins), (*box.outs, *more_outs), box.state
        )
    names = dict.fromkeys(name for name in (*ins, *outs) if ins[name] or outs[name])
    return [*boxes, *(Box(name, _ELSEWHERE, (*ins[name],), (*outs[name],)) for name in names)]


def _split(port: str) -> tuple[str, str]:
    """Return the component and the port of a full name such as `A0.out` or `host/A0.rtc:out`.

    An engine may know only a single name for a port of another system.
    """
    at = max(port.rfind("."), port.rfind(":"))
    return port[: max(0, at)] or port, port[at + 1 :]


def _layers(names: Sequence[str], joins: Iterable[tuple[str, str]]) -> dict[str, int]:
    """Return the maximum number of boxes in front of each box that has a connector."""
    after = defaultdict[str, list[str]](list)
    for source, target in joins:
        if source != target:
            after[source].append(target)
    order, state = list[str](), dict[str, int]()  # 1: on the way, 2: done
    forward = defaultdict[str, list[str]](list)
    for root in names:
        way = [(root, iter(after[root]))] if root not in state else []
        state.setdefault(root, 1)
        while way:
            name, targets = way[-1]
            reached = next(targets, None)
            if reached is None:
                state[name] = 2
                order.append(name)
                way.pop()
                continue
            if state.get(reached) != 1:  # else the wire closes a loop
                forward[name].append(reached)
            if reached not in state:
                state[reached] = 1
                way.append((reached, iter(after[reached])))
    layers = dict.fromkeys(names, 0)
    for name in reversed(order):
        for target in forward[name]:
            layers[target] = max(layers[target], layers[name] + 1)
    return layers


def _packed(intervals: Sequence[tuple[int, int]]) -> list[int]:
    """Return a number for each interval, so that intervals with one number do not touch."""
    ends, numbers = list[int](), [0] * len(intervals)
    for place in sorted(range(len(intervals)), key=lambda one: intervals[one]):
        begin, end = intervals[place]
        free = next((number for number, last in enumerate(ends) if last < begin), len(ends))
        ends[free : free + 1] = [end]
        numbers[place] = free
    return numbers


@dataclass(slots=True)
class _End:
    """One end of a wire.

    Attributes:
        row, column: position of the box of the end in the grid.
        line: line of the port, counted from the first line of the box.
        channel: the channel at the side of the port.
    """

    row: int
    column: int
    line: int
    channel: int


class _Layout:
    """The places of boxes and wires, for a number of columns of boxes.

    Args:
        boxes: boxes with unique names.
        wires: wires between ports of these boxes.
        count: number of columns of boxes.
        gap: number of cells from lane to lane.
        most: width of the screen in cells.
    """

    def __init__(
        self, boxes: Sequence[Box], wires: Sequence[Edge], count: int, gap: int, most: int
    ) -> None:
        self._boxes = {box.name: box for box in boxes}
        self._wires, self._gap = wires, gap
        self._most = max(_LEAST_BOX, min(_MOST_BOX, most - 2))
        self._cells = self._place(count)
        self._there = {cell: self._boxes[name] for name, cell in self._cells.items()}
        self._dense = {box.name for box in boxes if self._is_dense(box)}
        ends = dict(end for box in boxes for end in self._ends(box))
        self._ends_of = [(ends[wire.source], ends[wire.target]) for wire in wires]
        self._columns = 1 + max((column for _, column in self._cells.values()), default=0)
        self._rows = 1 + max((row for row, _ in self._cells.values()), default=-1)
        self._set_lines()
        self._set_columns()

    def _place(self, count: int) -> dict[str, tuple[int, int]]:
        """Return the row and column of each box."""
        joins = [(_owner(wire.source), _owner(wire.target)) for wire in self._wires]
        joined = {name for pair in joins for name in pair if pair[0] != pair[1]}
        names = [name for name in self._boxes if name in joined]
        layers = _layers(names, joins)
        before = defaultdict[str, list[str]](list)
        for source, target in joins:
            before[target].append(source)
        cells, top = dict[str, tuple[int, int]](), 0
        for band in range(0, 1 + max(layers.values(), default=-1), count):
            height = 0
            for column in range(count):
                layer = [name for name in names if layers[name] == band + column]
                rows = {
                    name: [cells[one][0] for one in before[name] if one in cells] or [top]
                    for name in layer
                }
                layer.sort(key=lambda name: sum(rows[name]) / len(rows[name]))
                for row, name in enumerate(layer):
                    cells[name] = top + row, column
                height = max(height, len(layer))
            top += height
        alone = [name for name in self._boxes if name not in joined]
        for number, name in enumerate(alone):
            cells[name] = top + number // count, number % count
        return cells

    def _is_dense(self, box: Box) -> bool:
        """Return whether a box may have a port on each line, without ports on both sides of one."""
        if box.ins and box.outs:
            return False
        row, column = self._cells[box.name]
        across = self._there.get((row, column + (1 if box.outs else -1)))
        return across is None or not (across.ins if box.outs else across.outs)

    def _ends(self, box: Box) -> Iterable[tuple[str, _End]]:
        row, column = self._cells[box.name]
        step, first = (1, 1) if box.name in self._dense else (2, 2)
        for number, port in enumerate(box.ins):
            yield f"{box.name}.{port}", _End(row, column, 1 + step * number, column)
        for number, port in enumerate(box.outs):
            yield f"{box.name}.{port}", _End(row, column, first + step * number, column + 1)

    def _height(self, box: Box) -> int:
        if box.name in self._dense:
            return 2 + max(1, len(box.ins), len(box.outs))
        return 2 + max(1, 2 * len(box.ins) - 1, 2 * len(box.outs))

    def _set_lines(self) -> None:
        """Assign tracks, then lines of rows and streets."""
        heights = [0] * self._rows
        for name, (row, _) in self._cells.items():
            heights[row] = max(heights[row], self._height(self._boxes[name]))
        far = [n for n, (a, b) in enumerate(self._ends_of) if a.channel != b.channel]
        street_of = {n: _street(*self._ends_of[n]) for n in far}
        track_of, tracks = dict[int, int](), [0] * (self._rows + 1)
        for street in range(self._rows + 1):
            here = [n for n in far if street_of[n] == street]
            spans = [(self._ends_of[n][0].channel, self._ends_of[n][1].channel) for n in here]
            packed = _packed([(min(span), max(span)) for span in spans])
            track_of |= dict(zip(here, packed, strict=True))
            tracks[street] = 1 + max(packed, default=-1)
        self._tops, streets, line = list[int](), list[int](), 0
        for row in range(self._rows + 1):
            streets.append(line)
            outer = row in (0, self._rows)
            line += tracks[row] if outer else max(1, tracks[row])
            if row < self._rows:
                self._tops.append(line)
                line += heights[row]
        self._track_lines = {n: streets[street_of[n]] + track for n, track in track_of.items()}
        self.height = line

    def _line(self, end: _End) -> int:
        return self._tops[end.row] + end.line

    def _set_columns(self) -> None:
        """Assign lanes, then cells of channels and columns."""
        lanes: list[list[tuple[int, int, int, int]]] = [[] for _ in range(self._columns + 1)]
        for number, (a, b) in enumerate(self._ends_of):
            first, last = self._line(a), self._line(b)
            if (track := self._track_lines.get(number)) is None:
                lanes[a.channel].append((min(first, last), max(first, last), number, 0))
            else:
                lanes[a.channel].append((min(first, track), max(first, track), number, 0))
                lanes[b.channel].append((min(track, last), max(track, last), number, 1))
        widths = [0] * self._columns
        for name, (_, column) in self._cells.items():
            widths[column] = max(widths[column], self._width(self._boxes[name]))
        self._lefts, self._widths, self._lanes = list[int](), widths, dict[tuple[int, int], int]()
        cell = 0
        for channel, here in enumerate(lanes):
            packed = _packed([(begin, end) for begin, end, _, _ in here])
            for (_, _, number, which), lane in zip(here, packed, strict=True):
                self._lanes[number, which] = cell + 1 + self._gap * lane
            width = 1 + self._gap * (1 + max(packed)) if packed else 0
            cell += max(3, width) if 0 < channel < self._columns else width
            if channel < self._columns:
                self._lefts.append(cell)
                cell += widths[channel]
        self.width = cell

    def _width(self, box: Box) -> int:
        texts = [box.name, f"{box.title} {box.state}".strip()]
        texts += [f"{port} " for port in (*box.ins, *box.outs)]
        inner = max(cell_len(_shown(text, self._most)) for text in texts)
        return max(_LEAST_BOX, min(self._most, inner + 4))

    def paint(self, lit: Mapping[str, str]) -> Picture:
        """Return the picture."""
        canvas = _Canvas()
        for number, wire in enumerate(self._wires):
            style = _PAST_PC if wire.dashed else _WIRE
            if wire.source in lit or wire.target in lit:
                style = LIT
            canvas.wire(self._path(number), style, dashed=wire.dashed)
        connected = {end for wire in self._wires for end in (wire.source, wire.target)}
        places = dict[str, _Place]()
        for box in self._boxes.values():
            self._paint_box(canvas, box, connected, lit, places)
        return Picture(canvas.lines(self.height), places)

    def _path(self, number: int) -> list[tuple[int, int]]:
        """Return the corners of a wire as line and cell."""
        a, b = self._ends_of[number]
        first, last, lane = self._line(a), self._line(b), self._lanes[number, 0]
        begin, end = (first, self._edge(a)), (last, self._edge(b))
        if (track := self._track_lines.get(number)) is None:
            return [begin, (first, lane), (last, lane), end]
        other = self._lanes[number, 1]
        return [begin, (first, lane), (track, lane), (track, other), (last, other), end]

    def _edge(self, end: _End) -> int:
        """Return the cell of the frame that contains a port."""
        left = self._lefts[end.column]
        return left if end.channel == end.column else left + self._widths[end.column] - 1

    def _paint_box(
        self,
        canvas: _Canvas,
        box: Box,
        connected: set[str],
        lit: Mapping[str, str],
        places: dict[str, _Place],
    ) -> None:
        row, column = self._cells[box.name]
        top, left, width = self._tops[row], self._lefts[column], self._widths[column]
        right, bottom = left + width - 1, top + self._height(box) - 1
        frame = _FRAMES.get(box.state, DIM)
        canvas.text(top, left, f"┌{'─' * (width - 2)}┐", frame)
        canvas.text(bottom, left, f"└{'─' * (width - 2)}┘", frame)
        for line in range(top + 1, bottom):
            canvas.text(line, left, f"│{' ' * (width - 2)}│", frame)
        name = _shown(box.name, width - 4)
        canvas.text(top, left + 1, f" {name} ", lit.get(box.name, _NAME))
        places[box.name] = _Place(top, left + 2, cell_len(name))
        state = _shown(box.state.capitalize(), width - 4)
        if state:
            at = right - 2 - cell_len(state)
            canvas.text(bottom, at, " ", frame)
            canvas.text(bottom, at + 1, state, STATES.get(box.state, DIM))
            canvas.text(bottom, right - 1, " ", frame)
        room = width - 4 - (cell_len(state) + 1 if state else 0)
        if box.title and room > 2:
            canvas.text(bottom, left + 1, f" {_shown(box.title, room)} ", DIM)
        ends = dict(self._ends(box))
        for port, is_in in (*((one, True) for one in box.ins), *((one, False) for one in box.outs)):
            full = f"{box.name}.{port}"
            text, line = _shown(port, width - 2), self._line(ends[full])
            size = cell_len(text)
            at = left + 1 if is_in else right - size
            canvas.text(line, at, text, lit.get(full, ""))
            if full in connected:
                style = LIT if full in lit else frame
                canvas.text(line, left if is_in else right, "▶" if is_in else "├", style)
            places[full] = _Place(line, at, size)


def _owner(port: str) -> str:
    return _split(port)[0]


def _street(a: _End, b: _End) -> int:
    """Return the street that gives a wire the shortest way up and down."""
    return min(
        (a.row, a.row + 1, b.row, b.row + 1),
        key=lambda street: abs(2 * street - 2 * a.row - 1) + abs(2 * street - 2 * b.row - 1),
    )


class _Canvas:
    """Cells with text, over cells with wires."""

    def __init__(self) -> None:
        self._texts = dict[tuple[int, int], tuple[str, str]]()
        self._wires = dict[tuple[int, int], tuple[int, str, bool]]()

    def text(self, line: int, cell: int, text: str, style: str) -> None:
        """Write a text. The second cell of a wide character has no text."""
        for one in text:
            self._texts[line, cell] = one, style
            cell += 1
            if cell_len(one) == 2:
                self._texts[line, cell] = "", style
                cell += 1

    def wire(self, corners: Sequence[tuple[int, int]], style: str, *, dashed: bool) -> None:
        """Draw a wire from corner to corner."""
        for (line, cell), (to_line, to_cell) in pairwise(corners):
            down = (to_line > line) - (to_line < line)
            right = (to_cell > cell) - (to_cell < cell)
            there = _SOUTH if down > 0 else _NORTH if down else _EAST if right > 0 else _WEST
            back = _NORTH if down > 0 else _SOUTH if down else _WEST if right > 0 else _EAST
            for step in range(abs(to_line - line) + abs(to_cell - cell)):
                at, after = line + step * down, cell + step * right
                self._add(at, after, there, style, dashed)
                self._add(at + down, after + right, back, style, dashed)

    def _add(self, line: int, cell: int, side: int, style: str, dashed: bool) -> None:
        sides, before, is_dashed = self._wires.get((line, cell), (0, style, dashed))
        shown_style = LIT if LIT in (before, style) else before
        self._wires[line, cell] = sides | side, shown_style, is_dashed and dashed

    def lines(self, height: int) -> tuple[_Line, ...]:
        """Return all lines, without blanks at their ends."""
        by_line = defaultdict[int, dict[int, tuple[str, str]]](dict)
        for (line, cell), (sides, style, dashed) in self._wires.items():
            sign = _SIGNS[sides]
            by_line[line][cell] = (_DASHED.get(sign, sign) if dashed else sign), style
        for (line, cell), piece in self._texts.items():
            by_line[line][cell] = piece
        return tuple(_pieces(by_line[line]) for line in range(height))


def _pieces(cells: Mapping[int, tuple[str, str]]) -> _Line:
    """Return the cells of a line. Adjacent cells of one style are one piece."""
    pieces = list[tuple[str, str]]()
    for cell in range(1 + max(cells, default=-1)):
        text, style = cells.get(cell, (" ", ""))
        if pieces and pieces[-1][1] == style:
            pieces[-1] = pieces[-1][0] + text, style
        elif text:
            pieces.append((text, style))
    return tuple(pieces)
