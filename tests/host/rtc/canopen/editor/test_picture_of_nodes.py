"""The picture of nodes in the editor: connections, links past the PC, and the keys in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.tui.pilot import screen_text
from tests.host.rtc.canopen.editor.desk import Desk, at_desk
from tests.host.rtc.canopen.editor.test_editor import two
from tickrig.host.rtc.canopen.definition import PdoLink, PdoName
from tickrig.host.tui import line_text

__all__ = ["two"]

LINK = PdoLink(PdoName(16, "tpdo2"), PdoName(32, "rpdo2"))


def picture(desk: Desk) -> str:
    return "\n".join(line_text(line).rstrip() for line in desk.app.picture.lines)


@pytest.mark.parametrize("size", [(80, 24), (120, 40), (140, 40)])
def test_nodes_are_boxes_and_a_pdo_link_is_a_dashed_wire(size: tuple[int, int]) -> None:
    async def act(desk: Desk) -> None:
        await desk.press("v")
        await desk.pass_ms(100)
        text = screen_text(desk.app)
        assert "┌ Palette0 ─" in text
        assert "┌ Motor0 ─" in text
        assert "node 16" in text
        assert "├╌┘" in text
        await desk.press("v")
        assert "16.tpdo2     290h" in screen_text(desk.app)

    at_desk(act, size=size)


def test_nodes_are_commanded_connected_linked_and_cut_in_the_picture(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.press("v")
        await desk.pass_ms(100)
        desk.app.picture.go_to("Palette0.tpdo2")
        await desk.press("a", then_ms=300)
        assert "Active" in picture(desk)
        await desk.press("m")
        desk.app.picture.go_to("Motor0.rpdo2")
        await desk.press("k", then_ms=100)
        assert set(desk.session.view.links) == {LINK}
        assert "╌" in picture(desk)
        await desk.press("x", then_ms=100)
        assert not desk.session.view.links
        await desk.press("m")
        desk.app.picture.go_to("Palette0.tpdo2")
        await desk.press("c", then_ms=100)
        assert "├─┘" in picture(desk)
        await desk.press("x", then_ms=100)
        assert not desk.session.view.connections
        await desk.press("x")
        assert desk.said[-1] == "go to a port that is connected or linked"

    at_desk(act, two)


def test_a_node_that_is_gone_stays_in_the_picture(two: Path) -> None:
    async def act(desk: Desk) -> None:
        await desk.press("v")
        desk.app.picture.go_to("Motor0.rpdo2")
        desk.nodes[32].physical["unplugged"].write(1)
        for _ in range(20):
            await desk.pass_ms(100)
        assert "┌ Motor0 ─" in picture(desk)
        assert "Absent" in picture(desk)
        assert desk.app.picture.at in desk.app.picture.picture.places
        await desk.press("a", "x", "m", "k", "p", "right", "down")

    at_desk(act, two)
