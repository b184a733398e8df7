from __future__ import annotations

from typing import Any

from tests.host.canmon.tui.pilot import drive_session, hear, on_monitor, shown, wire_session
from tests.host.canmon.wire import new_wire
from tickrig.host.canmon.tui.app import Monitor
from tickrig.host.tui.line_view import LineView


def test_nodes_and_their_emcys_are_shown() -> None:
    async def act(monitor: Monitor, pilot: Any) -> None:
        await pilot.press("2")
        lines = shown(monitor)
        assert lines[1].split()[:5] == ["5", "EPOS", "pre-operational", "->", "stopped"]
        assert lines[3] == "EMCY, latest first"
        assert "8210h PDO not processed" in lines[4]

    on_monitor(drive_session(), act)


def test_a_node_that_fell_silent_is_red() -> None:
    with new_wire() as wire:
        session = wire_session(wire)

        async def act(monitor: Monitor, pilot: Any) -> None:
            await pilot.press("2")
            hear(session, wire, "605#2B17100001000000", "585#6017100000000000", "705#05")
            while "LATE" not in "".join(shown(monitor)):  # 1.5 ms of the wall clock
                session.step(1_000)
            assert monitor.shown.query_one(LineView).lines[1][0][1] == "red"

        on_monitor(session, act)
