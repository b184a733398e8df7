"""`canmon nodes` in a terminal, fed by python-can over the loopback."""

from __future__ import annotations

from collections.abc import Iterator

import can
import pytest

from tests.host.canmon.terminal import Terminal
from tests.interop.buses import GROUP, PORT
from tickrig.host.canmon.output.listening import LEAVE

pytestmark = pytest.mark.realtime

BUS = (f"udp:{GROUP}", "--bus-kwargs", f"port={PORT}")


@pytest.fixture
def bus() -> Iterator[can.BusABC]:
    with can.Bus(interface="udp_multicast", channel=GROUP, port=PORT, hop_limit=0) as bus:
        yield bus


def tell(bus: can.BusABC, state: int) -> None:
    bus.send(can.Message(arbitration_id=0x705, data=[state], is_extended_id=False))


def test_a_node_is_shown_and_the_board_stays_in_the_terminal(bus: can.BusABC) -> None:
    terminal = Terminal("nodes", *BUS)
    terminal.wait_for("no node has sent a frame")
    tell(bus, 0x7F)
    terminal.wait_for("pre-operational")
    tell(bus, 0x05)
    terminal.wait_for("LATE")  # nobody sends another heartbeat
    terminal.child.send("q")
    assert terminal.end() == 0
    _, _, after = terminal.written.rpartition(LEAVE)
    assert "5     operational" in after


def test_ctrl_c_ends_it_without_a_traceback(bus: can.BusABC) -> None:
    terminal = Terminal("nodes", *BUS)
    terminal.wait_for("no node has sent a frame")
    terminal.child.sendintr()
    assert terminal.end() == 0
    assert "Traceback" not in terminal.written


def test_json_needs_no_screen_and_ends_after_its_time() -> None:
    terminal = Terminal("nodes", *BUS, "--for", "200ms", "--jsonl")
    assert terminal.end() == 0
    assert LEAVE not in terminal.written
