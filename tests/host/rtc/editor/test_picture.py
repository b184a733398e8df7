"""The picture of components and wires: where things are, and how wires meet."""

from __future__ import annotations

from collections import defaultdict
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from tickrig.host.rtc.editor.picture import Picture, _fitting, draw, neighbour
from tickrig.host.rtc.system.dot import Box, Edge

STATES = ("ACTIVE", "INACTIVE", "ERROR", "CREATED", "")


def box(name: str, ins: str = "in", outs: str = "out", state: str = "ACTIVE") -> Box:
    return Box(name, "Type", tuple(ins.split()), tuple(outs.split()), state)


def text(picture: Picture) -> str:
    return "\n".join("".join(piece for piece, _ in line).rstrip() for line in picture.lines)


CONTROL = (
    [
        box("Joystick0", "", "pos"),
        box("Map0", "pos", "vel", "INACTIVE"),
        box("Cart0", "vel", "pose odo", "ERROR"),
        box("Log0", "pose vel", ""),
    ],
    [
        Edge("Joystick0.pos", "Map0.pos"),
        Edge("Map0.vel", "Cart0.vel"),
        Edge("Map0.vel", "Log0.vel"),
        Edge("Cart0.pose", "Log0.pose"),
        Edge("Cart0.odo", "Map0.pos", dashed=True),
    ],
)

AT_120 = """\
                ┌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌┐
                ╎                     ┌──────────────────┼─┐
┌ Joystick0 ──┐ ╎   ┌ Map0 ─────────┐ │   ┌ Cart0 ─────┐ ╎ │   ┌ Log0 ───────┐
│             │ └╌┬─▶pos            │ │ ┌─▶vel         │ ╎ │ ┌─▶pose         │
│          pos├───┘ │            vel├─┴─┘ │        pose├─┼─┼─┘ │             │
└ Type Active ┘     └ Type Inactive ┘     │            │ ╎ └───▶vel          │
                                          │         odo├╌┘     └ Type Active ┘
                                          └ Type Error ┘"""


def test_components_stand_from_left_to_right_and_wires_cross() -> None:
    picture = draw(*CONTROL, 120)
    assert text(picture) == AT_120
    assert picture.width <= 120


def test_layers_that_do_not_fit_begin_below() -> None:
    picture = draw(*CONTROL, 60)
    assert picture.width <= 60
    places = picture.places
    assert places["Log0"].line > places["Joystick0"].line + 4
    assert len(places) == 4 + 8


@pytest.mark.parametrize("columns", [80, 120])
def test_thirty_components_fit_the_width_and_go_on_below(columns: int) -> None:
    boxes = [box(f"Node{n}") for n in range(30)]
    edges = [Edge(f"Node{n}.out", f"Node{n + 1}.in") for n in range(29)]
    picture = draw(boxes, edges, columns)
    assert picture.width <= columns
    assert all(sum(cell_len(one) for one, _ in line) <= columns for line in picture.lines)
    assert len({place[:2] for place in picture.places.values()}) == 90
    assert text(picture).count("▶") == text(picture).count("├") - text(picture).count("├─┼") == 29


def test_a_wide_name_takes_two_cells_for_a_character() -> None:
    boxes = [box("ロボット零", "", "値"), box("記録", "値", "")]
    picture = draw(boxes, [Edge("ロボット零.値", "記録.値")], 80)
    lines = text(picture).splitlines()
    assert "ロボット零" in lines[0]
    frame = {cell_len(line) for line in lines if "┐" in line and "記録" not in line}
    right = [cell_len(line[: line.index("├")]) for line in lines if "├" in line]
    corner = cell_len(lines[0][: lines[0].index("┐")])
    assert right == [corner]
    assert frame == set()
    long = draw([box("長い名前" * 9)], [], 40)
    assert "…" in text(long)
    assert long.width <= 40


HOSTILE = [
    "[red]x[/]",
    "\x1b[2J\x1b]0;t\x07",
    "a\u0301\u200b",
    "\u202eevil",
    "a\nb\tc",
    "",
    "a.b:c",
]


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_name_is_only_text(name: str) -> None:
    boxes = [box(name, "", name or "p"), box("B0")]
    picture = draw(boxes, [Edge(f"{name}.{name or 'p'}", "B0.in")], 80)
    pieces = [piece for line in picture.lines for piece, _ in line]
    assert all(piece.isprintable() for piece in pieces)
    assert all(cell_len(one) for piece in pieces for one in piece)
    assert name != "[red]x[/]" or "[red]x[/]" in text(picture)


def test_the_states_have_colours() -> None:
    boxes = [box(f"{state}0", state=state) for state in STATES if state]
    pieces = {piece for line in draw(boxes, [], 80).lines for piece in line}

    def style(state: str) -> str:
        return next(style for piece, style in pieces if f" {state}" in f" {piece}")

    assert [style(state) for state in ("Active", "Inactive", "Error")] == [
        *("bold green", "cyan", "bold white on red")
    ]


def test_a_port_that_runs_elsewhere_has_a_box_of_its_own() -> None:
    picture = draw([box("A0")], [Edge("A0.out", "host/Far0.rtc:in")], 80)
    assert "host/Far0.rtc" in text(picture)
    assert "elsewhere" in text(picture)
    assert "A0.out" in picture.places


def test_an_end_with_one_name_only_is_a_box_of_that_name() -> None:
    picture = draw([box("A0")], [Edge("A0.out", "outin")], 80)
    assert "┌ outin ─" in text(picture)
    assert text(picture).count("▶outin") == 1


def test_what_stands_out_has_its_style_and_so_have_its_wires() -> None:
    picture = draw(*CONTROL, 120, {"Map0.vel": "reverse"})
    pieces = {style for line in picture.lines for _, style in line}
    assert "reverse" in pieces
    assert "bold yellow" in pieces


def test_the_cursor_goes_to_what_is_next_in_a_direction() -> None:
    places = draw(*CONTROL, 120).places
    assert neighbour(places, "Joystick0", 1, 0) == "Joystick0.pos"
    assert neighbour(places, "Map0", 0, 1) == "Map0.pos"
    assert neighbour(places, "Map0.vel", 1, 0) == "Cart0.vel"
    assert neighbour(places, "Joystick0", -1, 0) == "Joystick0"
    reached, todo = {"Joystick0"}, ["Joystick0"]
    while todo:
        at = todo.pop()
        for way in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            if (to := neighbour(places, at, *way)) not in reached:
                reached.add(to)
                todo.append(to)
    assert reached == set(places)


def test_nothing_is_an_empty_picture() -> None:
    assert draw([], [], 80) == Picture((), {})


@st.composite
def systems(made: st.DrawFn) -> tuple[list[Box], list[Edge], int]:
    count = made(st.integers(1, 12))
    boxes = [
        Box(
            f"N{n}",
            made(st.sampled_from(("", "Type", "ロボ"))),
            tuple(f"i{p}" for p in range(made(st.integers(0, 3)))),
            tuple(f"o{p}" for p in range(made(st.integers(0, 3)))),
            made(st.sampled_from(STATES)),
        )
        for n in range(count)
    ]
    outs = [f"{one.name}.{port}" for one in boxes for port in one.outs]
    ins = [f"{one.name}.{port}" for one in boxes for port in one.ins]
    ends = outs if made(st.booleans()) else ins  # services join two right sides
    edges = []
    if outs and ends:
        pairs = st.tuples(st.sampled_from(outs), st.sampled_from(ends))
        edges = [Edge(*pair) for pair in made(st.lists(pairs, max_size=20))]
    return boxes, [edge for edge in edges if edge.source != edge.target], made(st.integers(10, 150))


@given(systems())
def test_no_two_wires_share_a_piece_unless_they_share_a_port(
    system: tuple[list[Box], list[Edge], int],
) -> None:
    boxes, edges, columns = system
    layout = _fitting(tuple(boxes), tuple(dict.fromkeys(edges)), columns)
    users = defaultdict[frozenset[tuple[int, int]], list[Edge]](list)
    corners = defaultdict[tuple[int, int], list[Edge]](list)
    for number, wire in enumerate(layout._wires):
        path = layout._path(number)
        for (line, cell), (to_line, to_cell) in pairwise(path):
            assert line == to_line or cell == to_cell
            cells = [
                (a, b)
                for a in range(min(line, to_line), max(line, to_line) + 1)
                for b in range(min(cell, to_cell), max(cell, to_cell) + 1)
            ]
            for one, other in pairwise(cells):
                users[frozenset((one, other))].append(wire)
        for corner in path[1:-1]:
            corners[corner].append(wire)
    for wires in (*users.values(), *corners.values()):
        first = wires[0]
        for wire in wires[1:]:
            assert {first.source, first.target} & {wire.source, wire.target}
    picture = layout.paint({})
    assert all(piece.isprintable() for pieces in picture.lines for piece, _ in pieces)
    assert picture.width <= layout.width
