"""PDO mappings, COB-IDs, types and links on the screen of the editor, down to the node."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.tui.pilot import screen_text
from tests.host.rtc.canopen.bench import EDS
from tests.host.rtc.canopen.editor.desk import Desk, at_desk
from tests.host.rtc.canopen.editor.test_editor import two
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.editor.pdo_screen import PdoScreen
from tickrig.host.rtc.editor.widgets import ChoiceScreen

__all__ = ["two"]


async def open_pdos(desk: Desk, node: str = "16 Palette0") -> None:
    await desk.go_to(node)
    await desk.press("p")
    for _ in range(3):
        await desk.pass_ms(100)


def told(desk: Desk) -> str:
    """Return what the lines at the bottom say, without line breaks, also those behind a hyphen."""
    return " ".join(desk.shown("pdo-status").split()).replace("- ", "-")


async def choose(desk: Desk, text: str) -> None:
    assert isinstance(desk.app.screen, ChoiceScreen)
    await desk.answer(text)


def mapping(desk: Desk, node_id: int, index: int) -> list[int]:
    entries = desk.nodes[node_id].slave.dictionary
    return [entries[index, sub].number for sub in range(1, entries[index, 0].number + 1)]


async def passed(desk: Desk) -> None:
    for _ in range(8):
        await desk.pass_ms(100)


def test_pdos_are_shown_with_cob_id_type_entries_and_links() -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        row = desk.line("16.tpdo2", "pdos")
        assert row == "16.tpdo2    1801h  on  290h  type 255  16 of 64 bits   → 32.rpdo2"
        entry = "    1  6401h:01  bit  0  16 bits  Read analogue input 16-bit 1"
        assert entry in desk.shown("pdos")
        assert "16.tpdo1    1800h  on  190h  type 255   8 of 64 bits" in desk.shown("pdos")
        assert "PDOs of 16 Palette0: Active" in screen_text(desk.app)

    at_desk(act)


def test_an_entry_is_inserted_replaced_and_removed_and_written(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo1", "pdos")
        await desk.press("i")
        await choose(desk, "6401h:05")
        assert "24 of 64 bits  changed" in desk.line("16.tpdo1", "pdos")
        await desk.go_to("6000h:01", "pdos")
        await desk.press("enter")
        await choose(desk, "6401h:06")
        await desk.go_to("6401h:02", "pdos")
        await desk.press("x")
        assert mapping(desk, 16, 0x1A00) == [0x6000_0108]
        assert "2 changed, not written" in desk.shown("pdo-status")
        await desk.press("w")
        await passed(desk)
        assert "written, and read back" in desk.shown("pdo-status")
        assert mapping(desk, 16, 0x1A00) == [0x6401_0610, 0x6401_0510]
        assert mapping(desk, 16, 0x1A01) == [0x6401_0110, 0x6401_0310, 0x6401_0410]
        await desk.press("escape")
        await desk.pass_ms(100)
        assert "16.tpdo1     190h 32 bits" in desk.shown()
        assert desk.line("out Palette0.tpdo1").endswith("TimedShortSeq")

    at_desk(act, two)


def test_an_active_node_is_active_again_and_its_link_follows_its_new_cob_id() -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo2", "pdos")
        await desk.press("c")
        await desk.answer("0x1A5")
        await desk.press("t")
        await desk.answer("254")
        await desk.press("w")
        await passed(desk)
        assert desk.nodes[16].slave.dictionary[0x1801, 1].number == 0x1A5
        assert desk.nodes[16].slave.dictionary[0x1801, 2].number == 254
        assert desk.nodes[32].slave.dictionary[0x1401, 1].number == 0x1A5
        assert "2 active" in desk.shown("status") or "PDOs of 16 Palette0: Active" in screen_text(
            desk.app
        )

    at_desk(act)


def test_a_pdo_is_switched_off_and_on(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo1", "pdos")
        for off in (True, False):
            await desk.press("o", "w")
            await passed(desk)
            cob_id = desk.nodes[16].slave.dictionary[0x1800, 1].number
            assert cob_id == (0x8000_0190 if off else 0x190)
            assert (" off " in desk.line("16.tpdo1", "pdos")) is off

    at_desk(act, two)


REFUSED = [
    ("16.tpdo2", "i", "6401h:05", "6401h:05 has 16 bits: the PDO would have 80 bits, at most 64"),
    ("16.tpdo2", "c", "0x601", "CAN-ID 601h belongs to another service: PDOs have 181h..6DFh"),
    ("16.tpdo2", "c", "0x900", "CAN-ID 900h is not in 001h..7FFh"),
    ("16.tpdo2", "c", "many", "'many' is not a CAN-ID, as 0x290 or 290h"),
    ("16.tpdo2", "t", "245", "transmission type 245 is reserved; allowed: 0..240, 252..255"),
    ("16.rpdo1", "t", "252", "transmission type 252 is reserved; allowed: 0..240, 254, 255"),
    ("16.tpdo2", "t", "fast", "'fast' is not a transmission type, as 1 or 255"),
    ("16.tpdo2", "x", "", "go to an entry of a PDO to remove it"),
    ("16.tpdo2", "w", "", "nothing was changed"),
]


def test_what_cannot_be_is_refused_and_changes_nothing(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        for row, key, answer, why in REFUSED:
            await desk.go_to(row, "pdos")
            await desk.press(key)
            if answer:
                await desk.answer(answer)
            assert told(desk).startswith(why)
        assert isinstance(desk.app.screen, PdoScreen)
        assert desk.app.screen.wanted == {}

    at_desk(act, two)


def test_a_refused_write_is_told_with_its_text_and_the_old_mapping_is_back(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.rpdo1", "pdos")
        await desk.press("i")
        await choose(desk, "dummy: 32")
        screen = desk.app.screen
        assert isinstance(screen, PdoScreen)
        odd = screen.wanted[0x1400]
        screen.wanted[0x1400] = type(odd)(odd.cob_id, (0x6401_0110,), 255, relative=False)
        await desk.press("w")
        await passed(desk)
        why = "1600h:01 refused: object cannot be mapped (06040041h); the old values are back"
        assert told(desk) == why
        assert why in screen_text(desk.app)
        assert mapping(desk, 16, 0x1600) == [0x6200_0108]
        assert desk.nodes[16].slave.dictionary[0x1400, 1].number == 0x210
        assert desk.session.view.definition().nodes[0].pdos == {}

    at_desk(act, two)


def test_a_node_that_is_gone_in_the_middle_has_its_old_mapping_when_it_is_back(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo1", "pdos")
        await desk.press("i")
        await choose(desk, "6401h:05")
        await desk.press("w")
        entries = desk.nodes[16].slave.dictionary
        while entries[0x1A00, 0].number:  # up to the step that empties the mapping
            desk.session.turn(desk.link.now_us + 1_000)
        desk.nodes[16].physical["unplugged"].write(1)
        await desk.press("x", "i", "o")
        assert told(desk) == "writing to the node ...; keys change nothing until it ends"
        for _ in range(20):
            await desk.pass_ms(100)
        assert "its old PDOs are written when it boots" in told(desk)
        assert "PDOs of 16 Palette0: " in screen_text(desk.app)
        assert entries[0x1A00, 0].number == 0
        desk.nodes[16].physical["unplugged"].write(0)
        for _ in range(20):
            await desk.pass_ms(100)
        assert mapping(desk, 16, 0x1A00) == [0x6000_0108]
        assert entries[0x1800, 1].number == 0x190

    at_desk(act, two)


def test_another_device_is_not_written_and_read_anew_when_the_right_one_is_back(two: Path) -> None:
    why = "1000h:00 is 000C0191h, not 00070191h"

    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo1", "pdos")
        await desk.press("t")
        await desk.answer("254")
        desk.session.server.nodes[16].refuse(why)
        await desk.pass_ms(100)
        assert f"PDOs of 16 Palette0: Inactive: {why}" in screen_text(desk.app)
        await desk.press("w")
        assert told(desk) == "node 16 is not ready"
        desk.session.view.write(16, 0x1801, 2, b"\x01")
        await desk.pass_ms(50)
        desk.session.view.boot(16)
        await passed(desk)
        assert "type   1" in desk.line("16.tpdo2", "pdos")
        assert "type 254   8 of 64 bits  changed" in desk.line("16.tpdo1", "pdos")

    at_desk(act, two)


def test_a_tpdo_is_linked_with_an_rpdo_of_another_node_and_cut(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo2", "pdos")
        await desk.press("k")
        await choose(desk, "32.rpdo2")
        await desk.pass_ms(100)
        assert desk.line("16.tpdo2", "pdos").endswith("→ 32.rpdo2")
        assert desk.nodes[32].slave.dictionary[0x1401, 1].number == 0x290
        await desk.press("k")
        assert "linked: cut" in desk.line("32.rpdo2", "choices")
        await choose(desk, "32.rpdo2")
        await desk.pass_ms(100)
        assert desk.nodes[32].slave.dictionary[0x1401, 1].number == 0x320
        await desk.go_to("16.tpdo1", "pdos")
        await desk.press("k")
        await choose(desk, "32.rpdo2")
        assert told(desk) == "16.tpdo1 has 8 bits, 32.rpdo2 has 64"

    at_desk(act, two)


def test_a_linked_rpdo_has_its_own_cob_id_again_after_it_was_set_up_anew() -> None:
    async def act(desk: Desk) -> None:
        await desk.go_to("32 Motor0")
        await desk.press("b")
        await passed(desk)
        await desk.press("p")
        await passed(desk)
        await desk.go_to("32.rpdo2", "pdos")
        await desk.press("c")
        await desk.answer("0x321")
        await desk.press("w")
        assert told(desk) == "32.rpdo2 is linked: cut the link to change its COB-ID"
        await desk.press("u", "k")
        await desk.pass_ms(100)
        assert desk.nodes[32].slave.dictionary[0x1401, 1].number == 0x320

    at_desk(act)


def test_what_was_changed_is_in_the_saved_definition(two: Path, tmp_path: Path) -> None:
    file = tmp_path / "after.yaml"

    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo1", "pdos")
        await desk.press("o", "i")
        await choose(desk, "6401h:05")
        await desk.press("w")
        await passed(desk)
        await desk.press("escape", "ctrl+s")
        await desk.answer(str(file))
        pdo = parse_definition(file.read_text("utf-8")).nodes[0].pdos["tpdo1"]
        assert pdo.mapping is not None
        assert [f"{entry.encode():08X}" for entry in pdo.mapping] == ["60000108", "64010510"]
        assert pdo.cob_id == 0x8000_0190

    at_desk(act, two)


def test_a_node_is_saved_as_dcf_and_the_dcf_is_loaded_again(two: Path, tmp_path: Path) -> None:
    file = tmp_path / "palette.dcf"

    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo1", "pdos")
        await desk.press("i")
        await choose(desk, "6401h:05")
        await desk.press("w")
        await passed(desk)
        await desk.press("ctrl+s")
        await desk.answer(str(file))
        await passed(desk)
        assert told(desk) == f"{file}: 126 values saved"
        text = file.read_text("utf-8")
        assert "NodeID=16" in text
        section = text[text.index("[1A00sub2]") :]
        assert "ParameterValue=0x64010510" in section[: section.index("\n[")]
        await desk.go_to("6401h:05", "pdos")
        await desk.press("x", "w")
        await passed(desk)
        assert mapping(desk, 16, 0x1A00) == [0x6000_0108]
        await desk.press("ctrl+o")
        await desk.answer(str(file))
        assert told(desk) == f"{file}: 1 changed PDO: w writes"
        await desk.press("w")
        await passed(desk)
        assert mapping(desk, 16, 0x1A00) == [0x6000_0108, 0x6401_0510]

    at_desk(act, two)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("none.dcf", "none.dcf: No such file or directory"),
        (f"{EDS}/f-palette.eds", "no ParameterValue of an object that can be written: no DCF"),
    ],
)
def test_a_dcf_that_cannot_be_used_is_refused(two: Path, name: str, why: str) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.press("ctrl+o")
        await desk.answer(name)
        assert told(desk).endswith(why)

    at_desk(act, two)


def test_changes_are_not_lost_by_one_key(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.go_to("16.tpdo1", "pdos")
        await desk.press("o", "escape")
        assert told(desk) == "1 changed, not written: w writes, again leaves"
        await desk.press("escape")
        assert not isinstance(desk.app.screen, PdoScreen)

    at_desk(act, two)


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (40, 12)])
def test_the_screen_fits_and_can_be_resized(two: Path, size: tuple[int, int]) -> None:
    async def act(desk: Desk) -> None:
        await open_pdos(desk)
        await desk.pilot.resize_terminal(*size)
        await desk.pass_ms(100)
        assert "write to the node" in screen_text(desk.app)
        assert "PDOs of 16 Palette0" in screen_text(desk.app)
        await desk.press("ctrl+c")
        assert desk.app._exit

    at_desk(act, two)
