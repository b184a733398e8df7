"""Hardware that emulators in other processes play: reached by tty or bus, and control socket."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import canopen
import pytest
from click.testing import CliRunner

from tests.emulators.testing.bench.modes.hardware.plans import played
from tests.interop.buses import MULTICAST
from tickrig import Bench
from tickrig.emulators.bench.child import Child, running
from tickrig.emulators.testing.bench.errors import MachineTooSlow, PortGone
from tickrig.emulators.testing.commands.compare_cli import compare_command
from tickrig.emulators.testing.rig_file.plan import (
    BusPlan,
    DeviceKind,
    DevicePlan,
    HardwarePlan,
    RigPlan,
    WirePlan,
    WireType,
)
from tickrig.host import LinkTimeout, RrcClient

pytestmark = pytest.mark.realtime


@pytest.fixture
def rrc() -> Iterator[Child]:
    with running("tickrig.emulators.rrc.cli") as child:
        yield child


@pytest.fixture
def bench(rrc: Child) -> Iterator[Bench]:
    with Bench.of_plan(played(rrc.link, rrc.control), "hardware") as bench:
        yield bench


def test_a_host_and_hands_at_an_rrc_in_another_process(bench: Bench) -> None:
    with RrcClient(bench.link) as client:
        client.start()
        bench.press("power_button")
        assert bench.wait_until(lambda: bench.get("state") == "Standby", within="8s")
        client.output(30, 0, confirm=True)
        assert bench.observe("VR2 drives", lambda: bench.get("out_v_pct") == 30)
        bench.perform("hold the stick", lambda: bench.set("stick", 5, 5))
        assert bench.get("stick_v_pct") == 5
        bench["rrc"].set("stick", 0, 0)
    assert "rrc > output1e00" in bench.transcript()
    assert "rrc < OK:output" in bench.transcript()
    assert "rrc ! power_button pressed for 0.1 s" in bench.transcript()


def test_what_passed_the_port_is_compared_with_an_emulator(bench: Bench, tmp_path: Path) -> None:
    with RrcClient(bench.link) as client:
        client.start()
        bench.press("power_button")
        assert bench.wait_until(lambda: bench.get("state") == "Standby", within="8s")
        client.output(30, 0, confirm=True)
        client.poweroff()
    trace = tmp_path / "run.trace"
    bench.save_trace(trace)
    result = CliRunner().invoke(compare_command, [str(trace), "--tolerance", "500ms"])
    assert "OK:output" in trace.read_text("ascii")
    assert " ! power_button=1" in trace.read_text("ascii")
    assert (result.exit_code, result.stderr) == (0, ""), result.output


def test_a_fault_comes_with_a_line_and_goes_in_its_time(bench: Bench) -> None:
    with RrcClient(bench.link) as client:
        client.start()
        bench.fault("bus_noise", when=bench.on_line("OK:device"), for_="50ms")
        client.start()
    assert "rrc ! bus_noise" in bench.transcript()
    assert bench.wait_until(lambda: bench.get("bus_noise") == 0, within="5s")
    bench.fault("cut")
    bench.clear("cut")
    bench.fault("flip=0.5@0s-1s")


def test_a_fault_that_waits_for_its_condition_can_be_cancelled(bench: Bench) -> None:
    ready: list[bool] = []
    bench.fault("bus_noise", when=lambda: bool(ready))
    assert [order.due_us for order in bench._mode.orders] == [None]
    bench.clear("bus_noise")
    ready.append(True)
    bench.run_for("50ms")
    assert bench.get("bus_noise") == 0
    assert list(bench._mode.orders) == []


def test_power_is_that_of_the_emulator(bench: Bench) -> None:
    bench.switch_off()
    assert bench.wait_until(lambda: bench.get("state") == "Off", within="5s")
    bench.switch_on()
    assert bench.wait_until(lambda: bench.get("state") != "Off", within="5s")


def test_a_pyserial_host_is_heard_too(bench: Bench) -> None:
    port = bench.serial(timeout=5)
    port.write(b"device\n")
    while port.read_until() != b"RRC\n":
        continue
    assert "rrc > device" in bench.transcript()


def test_hardware_that_is_stopped_says_nothing_of_the_device(rrc: Child, bench: Bench) -> None:
    with RrcClient(bench.link) as client:
        client.start()
        os.kill(rrc.process.pid, signal.SIGSTOP)
        os.waitid(os.P_PID, rrc.process.pid, os.WSTOPPED)
        with pytest.raises(LinkTimeout):
            client.start()
        os.kill(rrc.process.pid, signal.SIGCONT)
    assert bench.wait_until(lambda: bench._mode.too_slow() != "", within="5s")
    assert "the machine was too slow" in bench._mode.too_slow()


def test_hardware_that_never_answers_is_blocked(rrc: Child, bench: Bench) -> None:
    bench._mode._operators._operators["rrc"]._client._socket.settimeout(0.2)  # type: ignore[attr-defined]
    os.kill(rrc.process.pid, signal.SIGSTOP)
    os.waitid(os.P_PID, rrc.process.pid, os.WSTOPPED)
    with pytest.raises(MachineTooSlow, match="has not answered for"):
        bench.get("state")
    os.kill(rrc.process.pid, signal.SIGCONT)


def test_hardware_that_is_gone_is_blocked(rrc: Child, bench: Bench) -> None:
    link = bench.link
    rrc.process.kill()
    rrc.process.wait()
    with pytest.raises(PortGone, match=r"the emulator at .* is gone"):
        bench.get("state")
    with pytest.raises(PortGone, match=r"cannot read from .*tty"):
        link.receive(1_000_000)


def bus_plan(child: Child) -> RigPlan:
    bus = BusPlan(
        interface=MULTICAST.interface, channel=MULTICAST.channel, options=dict(MULTICAST.options)
    )
    return RigPlan(
        wires={"can": WirePlan(name="can", type=WireType.CAN, given=False)},
        devices={
            name: DevicePlan(
                name=name, kind=DeviceKind.MODEL, type="epos", wire="can", node_id=number
            )
            for name, number in (("left", 1), ("right", 2))
        },
        hardware=HardwarePlan(
            control={"left": child.control, "right": child.control}, buses={"can": bus}
        ),
    )


def test_a_master_meets_two_nodes_in_another_process() -> None:
    if why_not := MULTICAST.why_not():
        pytest.skip(why_not)
    nodes = ("--node", "1=epos", "--node", "2=epos")
    with (
        running(
            "tickrig.emulators.canopen.cli", *nodes, *MULTICAST.arguments, linked=False
        ) as child,
        Bench.of_plan(bus_plan(child), "hardware") as bench,
    ):
        assert bench.wait_until(lambda: bench.get("left/state") == "Pre-operational", within="5s")
        network = bench.canopen_network()
        left = network.add_node(1)
        left.sdo.RESPONSE_TIMEOUT = 5
        assert left.sdo.upload(0x1000, 0) == b"\x92\x01\x02\0"
        left.nmt.state = "OPERATIONAL"
        assert bench.wait_until(lambda: bench.get("left/state") == "Operational", within="5s")
        bench["left"].fault("sdo_abort=1000h:0x06010002,read")
        with pytest.raises(canopen.SdoAbortedError, match="0x06010002"):
            left.sdo.upload(0x1000, 0)
        bench["left"].clear("sdo_abort")
        bench["left"].fault("sdo_mute", for_="60s")
        left.sdo.RESPONSE_TIMEOUT, left.sdo.MAX_RETRIES = 0.3, 1
        with pytest.raises(canopen.SdoCommunicationError, match="No SDO response"):
            left.sdo.upload(0x1000, 0)
        bench["left"].clear("sdo_mute")
        left.sdo.RESPONSE_TIMEOUT = 5
        assert left.sdo.upload(0x1000, 0) == b"\x92\x01\x02\0"
        bench["right"].fault("power_off")
        assert bench.wait_until(lambda: bench["right"].get("state") == "Off", within="5s")
        assert "can > 000#0101" in bench.transcript()
