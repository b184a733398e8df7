from __future__ import annotations

import errno

import can
import pytest
from can.interfaces.virtual import VirtualBus

from tickrig.emulators.testing.bench.errors import PortGone
from tickrig.emulators.testing.bench.modes.bus_doors import open_watched_bus
from tickrig.emulators.testing.bench.modes.door_watch import HostPace
from tickrig.emulators.testing.rig_file.plan import BusPlan
from tickrig.host.text.trace import Mark

PLAN = BusPlan(interface="virtual", channel="watched")
MESSAGE = can.Message(arbitration_id=0x701, data=b"\x05", is_extended_id=False)


class Watch(HostPace):
    def __init__(self) -> None:
        super().__init__()
        self.heard = list[str]()

    def used(self) -> None:
        pass

    def passed(self, mark: Mark, frames: tuple[object, ...]) -> None:
        self.heard += [f"{mark} {frame}" for frame in frames]


def test_what_passes_is_told() -> None:
    watch = Watch()
    with open_watched_bus(PLAN, watch, {}) as bus, open_watched_bus(PLAN, Watch(), {}) as other:
        bus.send(MESSAGE)
        other.send(MESSAGE)
        assert bus.recv(0) is not None
        assert bus.recv(0) is None
    assert isinstance(bus, VirtualBus)
    assert watch.heard == ["> 701#05", "< 701#05"]


@pytest.mark.parametrize("code", [errno.ENODEV, errno.ENETDOWN])
def test_an_adapter_that_is_pulled_out_is_gone(code: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise can.CanOperationError("failed to transmit", code)

    monkeypatch.setattr(VirtualBus, "send", fail)
    monkeypatch.setattr(VirtualBus, "_recv_internal", fail)
    with open_watched_bus(PLAN, Watch(), {}) as bus:
        with pytest.raises(PortGone, match="failed to transmit"):
            bus.send(MESSAGE)
        with pytest.raises(can.CanOperationError):  # as hosts know it
            bus.recv(0)


def test_what_a_driver_cannot_read_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    came = iter([IndexError("string index out of range"), MESSAGE, TypeError(), MESSAGE])

    def receive(bus: can.BusABC, timeout: float | None) -> tuple[can.Message | None, bool]:
        one = next(came, None)
        if isinstance(one, Exception):
            raise one
        assert one is None or isinstance(one, can.Message)
        return one, False

    monkeypatch.setattr(VirtualBus, "_recv_internal", receive)
    watch = Watch()
    with open_watched_bus(PLAN, watch, {}) as bus:
        assert bus.recv(None) is not None
        assert bus.recv(0) is not None
        assert bus.recv(0) is None
    assert watch.heard == ["< 701#05"] * 2


def test_a_driver_that_always_fails_is_a_bus_that_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise TypeError("'NoneType' object is not subscriptable")

    monkeypatch.setattr(VirtualBus, "_recv_internal", fail)
    monkeypatch.setattr("tickrig.host.links.can_link.FAULTY_S", 0.0)
    with open_watched_bus(PLAN, Watch(), {}) as bus, pytest.raises(PortGone, match="100 reads"):
        bus.recv(None)


def test_a_bus_that_takes_nothing_is_there_still(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise can.CanOperationError("the buffer is full", errno.ENOBUFS)

    monkeypatch.setattr(VirtualBus, "send", fail)
    with open_watched_bus(PLAN, Watch(), {}) as bus, pytest.raises(can.CanOperationError) as caught:
        bus.send(MESSAGE)
    assert not isinstance(caught.value, PortGone)


def test_a_bus_that_cannot_be_opened_is_not_there() -> None:
    with pytest.raises(PortGone, match="cannot open nothing_such x: "):
        open_watched_bus(BusPlan(interface="nothing_such", channel="x"), Watch(), {})


def test_why_a_bus_cannot_be_opened_is_all_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise OSError(errno.EAFNOSUPPORT, "not supported")

    monkeypatch.setattr("can.Bus", fail)
    with pytest.raises(PortGone, match="udp_multicast needs none") as caught:
        open_watched_bus(BusPlan(interface="socketcan", channel="vcan0"), Watch(), {})
    assert caught.value.__suppress_context__
