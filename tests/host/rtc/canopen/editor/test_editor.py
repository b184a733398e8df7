"""The System Editor: each key, the mouse, and what is on the screen."""

from __future__ import annotations

from pathlib import Path

import pytest
from textual.binding import Binding
from textual.widgets import Markdown

from tests.host.canmon.tui.pilot import screen_text
from tests.host.rtc.canopen.bench import EDS
from tests.host.rtc.canopen.components import Knob
from tests.host.rtc.canopen.editor.desk import Desk, at_desk
from tickrig.host.rtc.canopen.definition import PdoLink, PdoName, RtConnection
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.editor.app import SystemEditor
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.editor.widgets import QuestionScreen
from tickrig.host.tui import FramedApp
from tickrig.wire.rtc_types.rtc import TimedShortSeq

TWO = f"""
nodes:
- {{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, role: device}}
- {{id: 32, name: Motor0, eds: {EDS}/motor-core-unit.eds, role: device}}
"""


@pytest.fixture
def two(tmp_path: Path) -> Path:
    """Return a System Definition of two nodes that nothing joins."""
    path = tmp_path / "two.yaml"
    path.write_text(TWO, "utf-8")
    return path


def test_nodes_are_shown_with_state_heartbeat_pdos_ports_and_links() -> None:
    async def act(desk: Desk) -> None:
        node = desk.line("Palette0")
        assert node.split()[:5] == ["▾", "16", "Palette0", "Active", "Operational"]
        assert node.endswith(" ms")
        assert "16.tpdo2     290h 16 bits  1801h ↔ 1401h" in desk.shown()
        assert "32.rpdo2     320h 16 bits  1401h ↔ 1801h ← 16.tpdo2" in desk.shown()
        assert "out Palette0.ai          TimedShort" in desk.shown()
        assert desk.shown().endswith("PDO link   16.tpdo2 → 32.rpdo2")
        assert "PdoLinked node 32: 16.tpdo2 to 32.rpdo2: 290h" in desk.shown("events")
        assert desk.shown("status") == " fig120.yaml  rig  2 of 2 nodes ready, 2 active"

    at_desk(act)


def test_a_proxy_is_deactivated_and_activated_from_any_of_its_rows() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("out Palette0.ai")
        await desk.press("d", then_ms=200)
        assert "Inactive Pre-operational" in desk.line("16 Palette0")
        assert "Active   Operational" in desk.line("32 Motor0")
        await desk.press("a", then_ms=200)
        assert "Active   Operational" in desk.line("16 Palette0")

    at_desk(act)


def test_what_a_proxy_refuses_is_told() -> None:
    async def act(desk: Desk) -> None:
        await desk.press("r")
        assert desk.said == ["reset Palette0: PRECONDITION_NOT_MET, it is ACTIVE"]

    at_desk(act)


def test_a_lost_node_is_in_error_and_is_reset_when_it_is_back() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("32 Motor0")
        desk.nodes[32].physical["unplugged"].write(1)
        await desk.pass_ms(450)
        assert "Error" in desk.line("32 Motor0")
        late = next(row for row in desk.app.system.rows_shown if row.key == "node 32")
        assert any(style == "bold red" and text.endswith("ms") for text, style in late.line)
        desk.nodes[32].physical["unplugged"].write(0)
        await desk.pass_ms(400)
        await desk.press("r", then_ms=400)
        assert "Active   Operational" in desk.line("32 Motor0")

    at_desk(act)


def test_a_node_that_is_refused_is_shown_with_the_reason_and_set_up_again(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.pass_ms(500)
        assert "refused: 1000h:00 is 00070191h, not 000C0191h" in desk.line("32 Motor0")
        await desk.go_to("32 Motor0")
        await desk.press("b", then_ms=100)
        assert sum(event.kind == "WrongIdentity" for event in desk.events) == 2

    at_desk(act, two, {16: "f-palette", 32: "f-palette"})


def test_all_nodes_are_started_in_their_order(two: Path) -> None:
    async def act(desk: Desk) -> None:
        assert "0 active" in desk.shown("status")
        await desk.press("S", then_ms=400)
        assert "2 active" in desk.shown("status")

    at_desk(act, two)


def test_ports_are_connected_through_the_pc_in_either_order(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("in  Motor0.rpdo2")
        await desk.press("m")
        assert "marked: Motor0.rpdo2" in desk.shown("status")
        await desk.go_to("out Palette0.tpdo2")
        await desk.press("c")
        assert desk.line("out Palette0.tpdo2").endswith("→ Motor0.rpdo2")
        assert desk.line("in  Motor0.rpdo2").endswith("← Palette0.tpdo2")
        assert "through PC Palette0.tpdo2 → Motor0.rpdo2" in desk.shown()
        assert "marked" not in desk.shown("status")

    at_desk(act, two)


def test_pdos_are_linked_in_either_order_and_unlinked(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("32.rpdo2")
        await desk.press("m")
        await desk.go_to("16.tpdo2")
        await desk.press("k", then_ms=50)
        assert set(desk.session.view.links) == {PdoLink(PdoName(16, "tpdo2"), PdoName(32, "rpdo2"))}
        assert desk.line("32.rpdo2").endswith("← 16.tpdo2")
        assert desk.nodes[32].slave.dictionary[0x1401, 1].number == 0x290
        await desk.go_to("PDO link")
        await desk.press("x", then_ms=50)
        assert not desk.session.view.links
        assert desk.nodes[32].slave.dictionary[0x1401, 1].number == 0x320

    at_desk(act, two)


def test_a_connection_is_removed_also_one_that_waits_for_its_ports(two: Path) -> None:
    waiting = "rt_connections: [{from: Palette0.tpdo2, to: Motor0.rpdo2}, {from: A.b, to: C.d}]\n"
    two.write_text(TWO + waiting, "utf-8")

    async def act(desk: Desk) -> None:
        assert desk.line("A.b → C.d").endswith("waits for its ports")
        await desk.go_to("A.b → C.d")
        await desk.press("x")
        await desk.go_to("Palette0.tpdo2 → ")
        await desk.press("x")
        assert desk.session.view.connections == ()

    at_desk(act, two)


REFUSED = [
    ("16.tpdo1", "32.rpdo2", "k", "16.tpdo1 has 8 bits, 32.rpdo2 has 64"),
    ("16.tpdo1", "16.tpdo2", "k", "16.tpdo1 and 16.tpdo2: a TPDO is linked with an RPDO"),
    ("16.tpdo1", "Motor0.rpdo2", "k", "16.tpdo1 has 8 bits, 32.rpdo2 has 64"),
    ("16.tpdo1", "Motor0.rpdo2", "c", "through the PC go ports: mark one, go to another"),
    ("out Palette0.tpdo1", "in  Motor0.rpdo2", "c", "Palette0.tpdo1 carries IDL:RTC/TimedOct"),
    ("16.tpdo1", "16.tpdo1", "x", "links and connections are removed: they are at the end"),
    ("16 Palette0", "16 Palette0", "m", "ports and PDOs can be marked"),
]


def test_what_does_not_fit_is_refused(two: Path) -> None:
    async def act(desk: Desk) -> None:
        for marked, other, key, why in REFUSED:
            await desk.go_to(marked)
            if marked != "16 Palette0":
                desk.app.system.marked = desk.app.system.row
            await desk.go_to(other)
            await desk.press(key)
            assert desk.said[-1].startswith(why)
        assert (desk.session.view.links, desk.session.view.connections) == ((), ())

    at_desk(act, two)


def test_a_mark_is_taken_back_by_its_key(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("16.tpdo2")
        await desk.press("m", "m")
        await desk.go_to("32.rpdo2")
        await desk.press("k")
        assert desk.said == ["mark a port or PDO first (m)"]

    at_desk(act, two)


def test_objects_of_the_node_under_the_cursor_are_read_as_they_come_into_view() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("1008h:00", "objects")
        for _ in range(3):
            await desk.pass_ms(20)
        assert desk.line("1008h:00", "objects").endswith("'f-palette'")
        assert not desk.line("6428h:08", "objects").endswith("0")
        await desk.go_to("32 Motor0")
        await desk.go_to("1008h:00", "objects")
        for _ in range(3):
            await desk.pass_ms(20)
        assert desk.line("1008h:00", "objects").endswith("'motor core unit'")

    at_desk(act)


def test_an_object_is_written_and_read_again() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("6426h:01", "objects")
        for _ in range(3):
            await desk.pass_ms(20)
        await desk.press("w")
        assert isinstance(desk.app.screen, QuestionScreen)
        await desk.press("1", "2", "enter")
        for _ in range(3):
            await desk.pass_ms(20)
        assert desk.nodes[16].slave.dictionary[0x6426, 1].number == 12
        assert desk.line("6426h:01", "objects").endswith(" 12")

    at_desk(act)


def test_a_value_that_cannot_be_is_told_and_one_that_is_refused_shown() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("6426h:01", "objects")
        await desk.press("w", "o", "n", "e", "enter")
        assert desk.said == ["'one' is no UNSIGNED32"]
        await desk.go_to("6401h:01", "objects")
        await desk.press("enter", "7", "enter")
        for _ in range(3):
            await desk.pass_ms(20)
        assert "06010002h" in desk.line("6401h:01", "objects")
        await desk.press("g")
        for _ in range(3):
            await desk.pass_ms(20)
        assert desk.line("6401h:01", "objects").endswith(" 0")

    at_desk(act)


@pytest.mark.parametrize("columns", [80, 130])
def test_the_reason_of_a_refusal_is_not_cut(columns: int) -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("6401h:01", "objects")
        await desk.press("enter", "7", "enter")
        for _ in range(3):
            await desk.pass_ms(20)
        assert "06010002h READ_ONLY" in screen_text(desk.app)

    at_desk(act, size=(columns, 24))


def test_what_is_cut_of_the_row_under_the_cursor_stands_below(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("32 Motor0")
        assert desk.app.system.border_subtitle is None
        why = "refused: 1018h:02 is 00000002h, not 00000001h in the EDS"
        desk.app.session.server.nodes[32].refuse(why)
        desk.app.look()
        await desk.pilot.pause()
        assert f" refused: {why} " in screen_text(desk.app)
        await desk.press("home")
        assert why not in screen_text(desk.app)

    at_desk(act, two)


def test_a_question_is_left_by_escape() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("6426h:01", "objects")
        await desk.press("w", "9", "escape", then_ms=50)
        assert desk.nodes[16].slave.dictionary[0x6426, 1].number == 8

    at_desk(act)


def test_objects_in_view_are_read_again_while_they_are_live() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("6401h:01", "objects")
        for _ in range(3):
            await desk.pass_ms(20)
        desk.nodes[16].physical["ai1_v"].write(2.5)
        await desk.pass_ms(100)
        assert desk.line("6401h:01", "objects").endswith(" 0")
        await desk.press("l")
        for _ in range(3):
            await desk.pass_ms(20)
        assert desk.line("6401h:01", "objects").endswith(" 16384")
        await desk.press("l", then_ms=20)  # what was asked for is still answered
        desk.nodes[16].physical["ai1_v"].write(0)
        for _ in range(3):
            await desk.pass_ms(20)
        assert desk.line("6401h:01", "objects").endswith(" 16384")

    at_desk(act)


def test_the_definition_is_saved_with_what_was_changed_and_loaded_again(tmp_path: Path) -> None:
    file = tmp_path / "saved.yaml"

    async def act(desk: Desk) -> None:
        await desk.go_to("PDO link")
        await desk.press("x")
        await desk.go_to("out Palette0.ai")
        await desk.press("m")
        await desk.go_to("in  Motor0.angle")
        await desk.press("c", "ctrl+s")
        await desk.answer(str(file))
        saved = parse_definition(file.read_text("utf-8"))
        assert saved.pdo_links == ()
        assert [(c.source, c.target) for c in saved.rt_connections] == [
            ("Palette0.ai", "Motor0.angle")
        ]
        assert (tmp_path / saved.nodes[0].eds).resolve() == EDS / "f-palette.eds"
        await desk.press("ctrl+o")
        await desk.answer(str(file))
        await desk.pass_ms(700)
        assert "2 active" in desk.shown("status")
        assert desk.line("out Palette0.ai").endswith("→ Motor0.angle")

    at_desk(act)


def test_a_file_that_cannot_be_used_is_told_and_the_server_goes_on(tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text("nodes: [{id: 200}]", "utf-8")

    async def act(desk: Desk) -> None:
        for key, file, why in (
            ("ctrl+o", bad, f"{bad}: line 1: "),
            ("ctrl+o", tmp_path / "none.yaml", f"{tmp_path}/none.yaml: No such file"),
            ("ctrl+s", tmp_path / "none" / "x.yaml", f"{tmp_path}/none/x.yaml: No such"),
        ):
            await desk.press(key)
            await desk.answer(str(file))
            assert desk.said[-1].startswith(why)
        assert desk.session.path.name == "fig120.yaml"

    at_desk(act)


def test_nodes_are_folded_and_opened_by_keys_and_mouse() -> None:
    async def act(desk: Desk) -> None:
        whole = len(desk.shown().splitlines())
        await desk.press("left")
        assert "16.tpdo2  " not in desk.shown()
        await desk.press("right")
        await desk.press("enter")
        assert desk.line("Palette0").startswith("▸")
        await desk.pilot.click("#system", offset=(1, 1))
        await desk.pilot.pause()
        assert len(desk.shown().splitlines()) == whole
        await desk.pilot.click("#system", offset=(8, 3), times=2)
        assert desk.app.system.cursor == 2

    at_desk(act)


def test_the_cursor_moves_by_keys_and_stays_on_its_row() -> None:
    async def act(desk: Desk) -> None:
        await desk.press("end")
        assert desk.app.system.row
        assert desk.app.system.row.key.startswith("link")
        await desk.press("home", "down", "down", "up")
        assert desk.app.system.cursor == 1
        await desk.go_to("32 Motor0")
        assert "objects of 32 Motor0" in str(desk.app.objects.border_title)
        desk.app.system.folded.add("node 16")
        desk.app.look()
        assert desk.app.system.row.key == "node 32"
        await desk.press("tab", "pagedown", "pagedown", "pageup")
        assert desk.app.objects.cursor > 0
        assert desk.app.objects.top > 0

    at_desk(act)


def test_panes_are_side_by_side_where_there_is_room() -> None:
    async def act(desk: Desk) -> None:
        for columns, lines, side_by_side in ((80, 24, False), (130, 40, True), (129, 24, False)):
            await desk.pilot.resize_terminal(columns, lines)
            await desk.pilot.pause()
            system, objects = desk.app.system.region, desk.app.objects.region
            assert (system.y == objects.y) is side_by_side
            assert min(system.height, objects.height) >= 6
            await desk.pass_ms(0)
            rows = screen_text(desk.app).splitlines()
            row = next(row for row in rows if "▾  16 Palette0" in row)
            assert " ms" in row.split("│")[1]

    at_desk(act)


def test_help_is_shown_and_hidden() -> None:
    async def act(desk: Desk) -> None:
        await desk.press("f1")
        (text,) = desk.app.screen.query("HelpPanel Markdown").results(Markdown)
        assert "mark a port or PDO" in text.source
        await desk.press("tab")
        await desk.pilot.pause()
        assert "Those that the EDS of the node has" in text.source
        await desk.press("question_mark")
        assert not desk.app.screen.query("HelpPanel")
        await desk.press("f1", "escape")
        assert not desk.app.screen.query("HelpPanel")

    at_desk(act)


@pytest.mark.parametrize("columns", [80, 100])
def test_all_keys_are_on_the_screen(columns: int) -> None:
    async def act(desk: Desk) -> None:
        text = screen_text(desk.app)
        for binding in (*SystemEditor.BINDINGS, *FramedApp.BINDINGS):
            assert isinstance(binding, Binding)
            if binding.show:
                assert f" {binding.description}" in text

    at_desk(act, size=(columns, 24))


@pytest.mark.parametrize("keys", [["q"], ["ctrl+c"], ["w", "ctrl+q"]])
def test_it_is_left(keys: list[str]) -> None:
    async def act(desk: Desk) -> None:
        await desk.press("tab", *keys)
        assert not desk.app.is_running or desk.app._exit

    at_desk(act)


def test_when_nothing_answers_the_tree_and_objects_are_empty(two: Path) -> None:
    async def act(desk: Desk) -> None:
        assert desk.line("16 Palette0").endswith("absent")
        assert "1000h:00" in desk.shown("objects")
        await desk.press("a")
        assert desk.said == ["no component 'Palette0'; known: none"]

    at_desk(act, two, {5: "f-palette"})


def test_an_eds_that_is_gone_has_no_objects(two: Path, tmp_path: Path) -> None:
    eds = tmp_path / "copy.eds"
    eds.write_bytes((EDS / "f-palette.eds").read_bytes())
    two.write_text(f"nodes: [{{id: 16, name: P, eds: {eds}}}, {{id: 32, name: M, eds: {eds}}}]\n")

    async def act(desk: Desk) -> None:
        eds.unlink()
        await desk.go_to("32 M")
        assert desk.shown("objects") == ""
        assert str(desk.app.objects.border_title) == "objects of 32 M"

    at_desk(act, two, {5: "f-palette"})


def test_components_beside_the_proxies_are_shown_and_connected(two: Path) -> None:
    def furnish(server: RtcCanopenServer) -> None:
        server.manager.add(Knob("Knob0", TimedShortSeq))

    async def act(desk: Desk) -> None:
        await desk.go_to("out Knob0.out")
        assert desk.app.objects.objects is None
        await desk.press("m", "g", "w", "l", "b")
        await desk.go_to("in  Motor0.rpdo2")
        await desk.press("c")
        assert desk.session.view.connections[0] == RtConnection(
            "Knob0.out", "Motor0.rpdo2", desk.session.view.connections[0].properties
        )
        await desk.go_to("Knob0 ")
        await desk.press("a", then_ms=20)
        assert desk.line("Knob0 ").split() == ["▾", "Knob0", "Active", "Knob"]
        await desk.press("enter")
        assert "out Knob0.out" not in desk.shown()

    at_desk(act, two, furnish=furnish)
