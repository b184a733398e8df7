from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import can
import pytest
import serial

from tests.host.links.slcan_adapter import OPTIONS, Adapter
from tickrig import Bench, InputBank
from tickrig.device import Rrc, make_epos
from tickrig.device.twin import Copyable
from tickrig.emulators.testing.bench.errors import (
    BenchBlocked,
    BenchError,
    NotOnThisBench,
    PortGone,
)
from tickrig.emulators.testing.rig_file.plan import (
    BusPlan,
    DeviceKind,
    DevicePlan,
    DoorPlan,
    RealPlan,
    RigPlan,
    WirePlan,
    WireType,
)
from tickrig.host import RrcClient
from tickrig.host.control.client import ControlClient

pytestmark = pytest.mark.realtime


def state(bench: Bench, name: str = "") -> Callable[[], object]:
    device = bench[name] if name else bench
    return lambda: device.get("state")


def test_a_host_and_hands_at_an_rrc_on_a_pty() -> None:
    with Bench(Rrc(), mode="real") as bench, RrcClient(bench.link) as client:
        client.start()
        bench.press("power_button")
        assert bench.wait_until(lambda: bench.get("state") == "Standby", within="4s")
        client.output(30, 0, confirm=True)
        assert bench.get("out_v_pct") == 30
        assert "rrc > output1e00" in bench.transcript()


def test_nothing_happens_before_somebody_comes() -> None:
    with Bench(Rrc(), mode="real") as bench:
        bench.set("stick", 100, -20)
        assert bench.now_us == 0
        port = bench.serial(timeout=5)
        assert port.readline() == b"EV:Initialized\n"


def test_waiting_in_vain_takes_at_least_the_time() -> None:
    with Bench(Rrc(), mode="real") as bench:
        begun_s, begun_us = time.monotonic(), bench.now_us
        assert not bench.wait_until(lambda: False, within="45ms")
        bench.run_for("30ms")
        assert bench.now_us - begun_us >= 75_000
        assert time.monotonic() - begun_s >= 0.075


def test_a_pyserial_host_finds_the_line_as_it_is() -> None:
    with Bench(Rrc(), mode="real") as bench:
        port = bench.serial(timeout=5)
        assert isinstance(port, serial.Serial)
        assert port.baudrate == 115_200
        assert port.read_until() == b"EV:Initialized\n"
        port.timeout = 0.01
        assert port.read(1) == b""
        port.write(b"device\n")
        port.timeout = 5
        assert port.read_until() == b"OK:device\n"
    with pytest.raises(serial.SerialException, match="not open"):  # the bench has closed it
        port.read(1)


def test_a_host_with_another_rate_is_noted() -> None:
    with Bench(Rrc(), mode="real") as bench:
        bench.serial(baudrate=9_600)
        assert bench.wait_until(lambda: "set its port to 9600 8N1" in bench.transcript(), "5s")


def test_masters_meet_two_nodes() -> None:
    with Bench(left=make_epos(1), right=make_epos(2), mode="real") as bench:
        bus = bench["left"].can_bus()
        heard = {message.arbitration_id for _ in range(2) if (message := bus.recv(5.0))}
        assert heard == {0x701, 0x702}
        network = bench.canopen_network()
        left = network.add_node(1)
        assert left.sdo.upload(0x1000, 0) == b"\x92\x01\x02\0"
        left.nmt.state = "OPERATIONAL"
        assert bench.wait_until(lambda: bench.get("left/state") == "Operational", within="5s")
        assert bench.get("right/state") == "Pre-operational"
        bus.shutdown()
        network.disconnect()  # who tidies up himself may do so


def test_a_line_and_a_bus_share_a_bench() -> None:
    with Bench(drive=make_epos(1), panel=Rrc(), mode="real") as bench:
        frames = bench["drive"].link
        assert bench["panel"].link.receive(5_000_000).startswith(b"EV:")
        assert str(frames.receive(5_000_000)[0]) == "701#00"


def test_a_condition_may_ask_a_device() -> None:
    with Bench(make_epos(1), mode="real") as bench:
        node = bench.canopen_network().add_node(1)
        assert bench.wait_until(lambda: len(node.sdo.upload(0x1000, 0)) == 4, within="5s")
        assert not bench.wait_until(lambda: node.sdo.upload(0x1000, 0) == b"", within="20ms")


def test_a_fault_comes_with_a_line_and_goes_in_its_time() -> None:
    with Bench(Rrc(), mode="real") as bench, RrcClient(bench.link) as client:
        client.start()
        begun = bench.on_line("OK:device")
        bench.fault("bus_noise", when=begun, for_="20ms")
        client.start()
        assert begun()
        assert bench.wait_until(lambda: bench.get("bus_noise") == 0, within="5s")
        assert [line for line in bench.transcript().split("\n") if "bus_noise=" in line] != []


def test_what_a_condition_raises_is_raised_where_it_is_waited_for() -> None:
    with Bench(Rrc(), mode="real") as bench:
        with pytest.raises(ValueError, match="no input or output"):
            bench.wait_until(lambda: bench.get("nothing") == 1, within="1s")
        assert bench.wait_until(lambda: bench.wait_until(lambda: True, "1s"), within="1s")
        assert bench.wait_until(lambda: True, within="1s")


class Brittle(Copyable):
    """A device that breaks."""

    tick_us, due_us = 1_000, 5_000

    def __init__(self) -> None:
        self.inputs, self.outputs = InputBank(), dict[str, str]()

    def tick(self, now_us: int, received: bytes) -> bytes:
        raise ZeroDivisionError("the device is broken")

    def reset(self) -> None:
        pass

    def read(self, name: str) -> int:
        raise KeyError(name)


def test_what_a_device_raises_is_raised_by_the_next_call() -> None:
    with (
        pytest.raises(ZeroDivisionError, match="the device is broken"),
        Bench(Brittle(), mode="real") as bench,  # type: ignore[arg-type]  # it has no outputs
    ):
        bench.run_for("1s")


def test_what_a_device_raises_unheard_is_raised_in_the_end() -> None:
    bench = Bench(Brittle(), mode="real")  # type: ignore[arg-type]  # it has no outputs
    bench.serial(timeout=0.05).read(1)
    assert bench.now_us == 5_000
    with pytest.raises(ZeroDivisionError, match="the device is broken"):
        bench.close()


def test_a_closed_bench_still_tells() -> None:
    with Bench(Rrc(), mode="real") as bench:
        bench.run_for("20ms")
    assert "EV:Initialized" in bench.transcript()
    assert bench.get("state") == "WaitPowerOn"
    with pytest.raises(BenchError, match="the bench is closed"):
        bench.run_for("1ms")
    assert sys.getswitchinterval() == 0.005


def test_what_real_time_cannot_do_is_told() -> None:
    with Bench(Rrc(), mode="real") as bench:
        with pytest.raises(NotOnThisBench, match="a twin goes on in virtual time"):
            bench.fork()
        with pytest.raises(ValueError, match="rrc is a serial line, not a CAN bus"):
            bench.can_bus()
    with pytest.raises(ValueError, match="is virtual or real, not 'unreal'"):
        Bench(Rrc(), mode="unreal")


def plan(real: RealPlan) -> RigPlan:
    return RigPlan(
        wires={"rrc": WirePlan(name="rrc", given=False), "can": _bus_plan()},
        devices={
            "rrc": DevicePlan(name="rrc", kind=DeviceKind.SERIAL, type="rrc", wire="rrc"),
            "epos": DevicePlan(name="epos", kind=DeviceKind.MODEL, type="epos", wire="can"),
        },
        real=real,
    )


def _bus_plan() -> WirePlan:
    return WirePlan(name="can", type=WireType.CAN, given=False)


def test_a_plan_says_where_hosts_come_in(tmp_path: Path) -> None:
    real = RealPlan(
        control=tmp_path / "ctl",
        doors={
            "rrc": DoorPlan(link=tmp_path / "rrc", serve=("socket://0",)),
            "can": DoorPlan(bus=BusPlan(interface="virtual", channel="modes")),
        },
    )
    with Bench.of_plan(plan(real), "real") as bench, ControlClient(tmp_path / "ctl") as control:
        bus = can.Bus("modes", "virtual")
        port = serial.Serial(str(tmp_path / "rrc"), timeout=5)
        assert control.request("status")["now_us"] == 0
        bench.run_for("100ms")
        assert bus.recv(5.0) is not None
        assert port.read_until() == b"EV:Initialized\n"
        control.request("set", name="rrc/gauge", value=3)
        assert bench["rrc"].get("gauge") == 3
        port.close()
        bus.shutdown()
    assert list(tmp_path.iterdir()) == []


def test_a_test_is_blocked_if_the_adapter_of_its_bus_is_unplugged() -> None:
    adapter = Adapter()
    bus = BusPlan(interface="slcan", channel=adapter.name, options=OPTIONS)
    with Bench.of_plan(plan(RealPlan(doors={"can": DoorPlan(bus=bus)})), "real") as bench:
        adapter.send(b"t12\r")
        bench.run_for("50ms")
        adapter.unplug()
        with pytest.raises(PortGone, match=f"slcan {adapter.name}: the last [0-9]+ reads have"):
            bench.run_for("60s")


def test_what_cannot_be_opened_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "ctl").write_text("a file")
    real = RealPlan(control=tmp_path / "ctl", doors={"rrc": DoorPlan(link=tmp_path / "rrc")})
    with pytest.raises(FileExistsError):
        Bench.of_plan(plan(real), "real")
    assert [path.name for path in tmp_path.iterdir()] == ["ctl"]


def test_a_line_is_at_a_tcp_port_where_there_are_no_ptys(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tickrig.emulators.serial.pty_port", None)
    with Bench(Rrc(), mode="real") as bench:
        assert bench.serial(timeout=5).read_until() == b"EV:Initialized\n"
    with Bench(Rrc(), mode="real") as bench:
        assert bench.link.receive(5_000_000).startswith(b"EV:")


def test_a_second_host_at_a_line_is_refused() -> None:
    with Bench(Rrc(), mode="real") as bench, bench.serial(timeout=5) as port:
        with pytest.raises(BenchBlocked, match="another program uses it"):
            bench.serial()
        with pytest.raises(BenchBlocked, match="another program uses it"):
            _ = bench.link
        assert port.readline() == b"EV:Initialized\n"
        bench.serial(exclusive=None).close()  # asked for
