"""A server in a thread, on a bus of python-can."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import can
import pytest

from tests.host.rtc.canopen.bench import SYSTEMS
from tickrig.host.links.can_link import CanLink
from tickrig.host.links.link import LinkClosed, StampedFrames, StampedLink
from tickrig.host.rtc.canopen.editor.session import EditorSession
from tickrig.host.rtc.canopen.events import ServerEvent, ServerEventType
from tickrig.host.rtc.canopen.serve import open_server
from tickrig.wire.can import ErrorState, Frames

FIG_120 = SYSTEMS / "fig120.yaml"
PATIENCE_S = 20.0

pytestmark = pytest.mark.realtime


class Broken:
    """A link whose bus goes away."""

    now_us = 0

    def send(self, traffic: Frames, /) -> None:
        raise LinkClosed("gone")

    def receive(self, timeout_us: int, /) -> Frames:
        raise LinkClosed("gone")

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        raise LinkClosed("gone")

    def close(self) -> None:
        """Nothing is open."""


def session(link: StampedLink, *listeners: Callable[[ServerEvent], None]) -> EditorSession:
    return EditorSession(open_server(FIG_120), FIG_120, link, listeners=listeners)


def test_it_looks_for_its_nodes_and_leaves_them_at_the_end() -> None:
    with can.Bus(interface="virtual", channel="session") as other:
        link = CanLink.open("session", "virtual")
        running = session(link)
        running.start()
        first = [other.recv(PATIENCE_S) for _ in range(3)]
        running.close()
        link.close()
        rest = list(iter(lambda: other.recv(0), None))
    assert [one.arbitration_id for one in first if one] == [0x77F, 0x610, 0x620]
    assert [bytes(one.data).hex() for one in rest if one and not one.arbitration_id] == [
        "8210",
        "8220",
    ]


def test_events_and_bus_states_reach_whoever_listens_also_after_another_definition() -> None:
    off = threading.Event()

    def listen(event: ServerEvent) -> None:
        if event.kind is ServerEventType.BUS_OFF:
            off.set()

    link = CanLink.open("session2", "virtual")
    running = session(link, listen)
    running.load(FIG_120)
    running.start()
    running.bus_state(ErrorState.BUS_OFF)
    assert off.wait(PATIENCE_S)
    running.close()
    link.close()


def test_a_bus_that_is_gone_ends_it() -> None:
    running = session(Broken())
    running.start()
    with pytest.raises(LinkClosed, match="gone"):
        running.close()
    assert running.ended


def test_files_are_seen_from_where_the_definition_was_read(tmp_path: Path) -> None:
    running = session(Broken())
    before = running.eds_paths
    running.save(tmp_path / "robot.yaml")
    assert running.eds_paths == before
    assert running.path == tmp_path / "robot.yaml"
    running.load(running.path)
    assert {n: p.resolve() for n, p in running.eds_paths.items()} == {
        n: p.resolve() for n, p in before.items()
    }
