from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

import pytest

from tests.emulators.echo import Echo
from tests.host.live import pty
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.link import LinkClosed, ReopeningLink
from tickrig.host.links.serial_link import SerialLink


class Line:
    """A line in virtual time that comes and goes."""

    def __init__(self) -> None:
        line = SerialLine()
        self._rig, self._end = Rig(Station(Echo(), line.a)), line.b
        self.there = True
        self.links: list[SimLink] = []

    def open(self) -> SimLink:
        if not self.there:
            raise LinkClosed("no such line")
        self.links.append(SimLink(self._rig, self._end))
        return self.links[-1]

    def go(self) -> None:
        self.there = False
        self.links[-1].close()


def test_a_line_that_came_back_is_opened_at_the_next_send() -> None:
    line = Line()
    link = ReopeningLink(line.open)
    line.go()
    with pytest.raises(LinkClosed, match="closed"):
        link.send(b"a")
    with pytest.raises(LinkClosed, match="no such line"):
        link.send(b"b")
    line.there = True
    with pytest.raises(LinkClosed):
        link.receive(0)
    link.send(b"c")
    assert link.receive(1_000_000) == b"c"
    assert len(line.links) == 2


def test_time_goes_on_while_the_line_is_gone() -> None:
    line = Line()
    link = ReopeningLink(line.open)
    assert link.receive(5_000) == b""
    line.go()
    with pytest.raises(LinkClosed):
        link.receive(0)
    assert link.now_us == 5_000


def test_a_closed_link_is_not_opened_again() -> None:
    line = Line()
    link = ReopeningLink(line.open)
    link.close()
    link.close()
    with pytest.raises(LinkClosed):
        link.send(b"a")
    assert len(line.links) == 1


def test_a_line_that_is_not_there_at_first_is_refused() -> None:
    with pytest.raises(LinkClosed, match="cannot open '/dev/no-such-port'"):
        ReopeningLink(lambda: SerialLink("/dev/no-such-port"))


@contextmanager
def two_ptys() -> Iterator[tuple[str, str, ExitStack]]:
    """Two terminals; leaving the stack ends the first."""
    with ExitStack() as first, pty() as second:
        yield first.enter_context(pty()).path, second.path, first


@pytest.mark.realtime
def test_a_terminal_that_ended_is_replaced_by_the_next_one() -> None:
    with two_ptys() as (one, two, first):
        paths = iter((one, two))
        link = ReopeningLink(lambda: SerialLink(next(paths)))
        first.close()
        with pytest.raises(LinkClosed, match=f"'{one}'"):
            link.receive(1_000_000)
        link.send(b"x")
        assert link.receive(1_000) == b""
        link.close()
