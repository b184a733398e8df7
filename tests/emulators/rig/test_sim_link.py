from __future__ import annotations

import pytest

from tests.emulators.echo import Echo
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.link import LinkClosed


def linked() -> SimLink:
    line = SerialLine()
    return SimLink(Rig(Station(Echo(), line.a)), line.b)


def test_time_passes_while_the_host_waits() -> None:
    link = linked()
    link.send(b"hello")
    assert link.receive(1_000_000) == b"hello"
    assert link.now_us == 20_000 + 435  # two ticks, then five bytes on the line


def test_silence_lasts_exactly_the_timeout() -> None:
    link = linked()
    assert link.receive(123_456) == b""
    assert link.now_us == 123_456


def test_a_long_send_waits_until_it_fits() -> None:
    line, echo = SerialLine(buffer_bytes=200), Echo()
    rig = Rig(Station(echo, line.a))
    link = SimLink(rig, line.b)
    link.send(b"x" * 1_000)
    assert link.now_us >= 800 * 86  # four buffers have left, at 86.8 us a byte
    rig.run_for(100_000)
    assert echo.heard == b"x" * 1_000


def test_a_closed_link_says_so() -> None:
    link = linked()
    link.close()
    link.close()
    with pytest.raises(LinkClosed, match="closed"):
        link.send(b"x")
    with pytest.raises(LinkClosed, match="closed"):
        link.receive(1)
