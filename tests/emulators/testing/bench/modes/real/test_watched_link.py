from __future__ import annotations

from typing import Any

import pytest

from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.emulators.testing.bench.modes.door_watch import HostPace, LinkGone, WatchedLink
from tickrig.host.links.link import LinkClosed
from tickrig.host.text.trace import Mark


class Stumbling:
    """A link whose waits take as much longer as they are told."""

    def __init__(self) -> None:
        self.now_us, self.late_us, self.data, self.error = 0, 0, b"", ""

    def send(self, traffic: bytes, /) -> None:
        self._check()

    def receive(self, timeout_us: int, /) -> bytes:
        self._check()
        self.now_us += self.late_us + (0 if self.data else timeout_us)
        return self.data

    def close(self) -> None:
        self.error = "closed"

    def _check(self) -> None:
        if self.error:
            raise LinkClosed(self.error)


class Watch(HostPace):
    def __init__(self) -> None:
        super().__init__()
        self.heard = list[tuple[Mark, Any]]()

    def used(self) -> None:
        pass

    def passed(self, mark: Mark, traffic: Any) -> None:
        self.heard.append((mark, traffic))


def test_a_wait_in_vain_that_took_longer_was_late() -> None:
    behind, watch = Stumbling(), Watch()
    link = WatchedLink(behind, watch)
    assert (link.receive(25_000), watch.late_us) == (b"", 0)
    behind.late_us = 7_000
    assert (link.receive(10_000), link.now_us, watch.late_us) == (b"", 42_000, 7_000)


def test_what_passes_is_told() -> None:
    behind, watch = Stumbling(), Watch()
    link = WatchedLink(behind, watch)
    link.send(b"device\n")
    behind.data = b"OK"
    link.receive(1_000)
    assert watch.heard == [(Mark.TO_DEVICE, b"device\n"), (Mark.FROM_DEVICE, b"OK")]


def test_a_port_that_is_gone_says_nothing_of_the_device() -> None:
    behind = Stumbling()
    link = WatchedLink(behind, Watch())
    behind.error = "cannot read from '/dev/ttyUSB0': gone"
    with pytest.raises(PortGone, match="cannot read from '/dev/ttyUSB0': gone"):
        link.receive(0)
    with pytest.raises(LinkClosed):  # as hosts know it
        link.send(b"x")


def test_a_link_that_the_host_has_closed_is_his_own_affair() -> None:
    link = WatchedLink(Stumbling(), Watch())
    link.close()
    with pytest.raises(LinkClosed) as caught:
        link.receive(0)
    assert not isinstance(caught.value, LinkGone)
