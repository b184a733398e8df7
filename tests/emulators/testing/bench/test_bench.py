from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import can
import pytest
import serial
from click.testing import CliRunner

from tickrig import Bench, BenchError, NotOnThisBench, open_bench
from tickrig.device import Rrc, make_epos, make_f_palette
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.rrc.settings import RrcConfig
from tickrig.emulators.serial.outside.serial_ports import SERIAL_PORTS
from tickrig.emulators.testing.commands.replay_cli import replay_command
from tickrig.host import RrcClient
from tickrig.host.links.can_link import to_frame, to_message
from tickrig.host.text.names import near
from tickrig.wire.can import CanFrame


def test_a_host_and_hands_share_one_time() -> None:
    with Bench(Rrc(), seed=1) as bench, RrcClient(bench.link) as client:
        client.start()
        bench.press("power_button")
        assert bench.wait_until(lambda: bench.get("state") == "Standby", within="2s")
        client.output(30, 0, confirm=True)
        assert (bench.get("out_v_pct"), bench.now_us) == (30, client.now_us)


def test_a_serial_bench_imports_nothing_that_others_need() -> None:
    program = (
        "import sys; from tickrig import Bench\n"
        "with Bench('rrc') as bench: bench.run_for('100ms')\n"
        "print(*sys.modules)"
    )
    modules = subprocess.check_output([sys.executable, "-c", program], text=True).split()
    others = "tickrig.device.canopen", "tickrig.wire.canopen", "tickrig.emulators.testing.signals"
    assert [name for name in modules if name.startswith((*others, "can.", "tomllib"))] == []


UPLOAD = to_message(CanFrame.parse("610#4008100000000000"))
TIMED_OUT = "590#8008100000000405"


def times_out_after(bench: Bench) -> int:
    """Return after how many ms of silence a transfer is aborted."""
    bus = bench.can_bus()
    bench.run_for("10ms")
    bus.send(UPLOAD)
    begun_us = bench.now_us
    while (message := bus.recv(10)) is not None:
        if str(to_frame(message)) == TIMED_OUT:
            return (bench.now_us - begun_us) // 1_000
    raise AssertionError("it is never aborted")


@pytest.mark.parametrize("device", ["f-palette", make_f_palette])
def test_a_bench_says_the_sdo_time_out_of_its_nodes(
    device: str | Callable[[int], CanopenSlave], tmp_path: Path
) -> None:
    with Bench(device if isinstance(device, str) else device(16), sdo_timeout="50ms") as bench:
        assert 50 <= times_out_after(bench) <= 52
        bench.save_trace(tmp_path / "trace")
    assert (
        CliRunner().invoke(replay_command, [str(tmp_path / "trace")]).output.startswith("identical")
    )
    with Bench(device if isinstance(device, str) else device(16)) as bench:
        assert 5_000 <= times_out_after(bench) <= 5_002


def test_a_rig_file_says_the_sdo_time_out_of_a_node(tmp_path: Path) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text('[device.drive]\ntype = "f-palette"\nsdo_timeout = "20ms"\nsdo_memory = "1k"\n')
    with open_bench(rig) as bench:
        assert 20 <= times_out_after(bench) <= 22


def test_an_sdo_time_out_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="an SDO time-out of 0 us is less than 1 us"):
        Bench("epos", sdo_timeout=0)
    with pytest.raises(ValueError, match="'5' has no unit"):
        Bench("epos", sdo_timeout="5")
    with pytest.raises(ValueError, match="sdo_timeout is of CANopen nodes, and none is on this"):
        Bench("rrc", sdo_timeout="1s")


def test_a_bench_says_what_there_is_to_set_to_read_and_to_break() -> None:
    with Bench(drive="epos", chair="rrc") as bench:
        drive, chair, everything = (
            bench["drive"].describe(),
            bench["chair"].describe(),
            bench.describe(),
        )
        assert (drive.name, chair.name) == ("drive", "chair")
        assert chair.inputs["gauge"].high == 10
        assert chair.groups["stick"] == ("stick_v_pct", "stick_w_pct")
        assert chair.outputs["out_v_pct"].unit == "%"
        assert "power_button" in chair.buttons
        assert everything.buttons == tuple(f"chair/{name}" for name in chair.buttons)
        head, title, first, *_ = str(chair).splitlines()
        assert (head, title) == ("chair", "inputs")
        assert first.split()[:5] == ["rrc_power", "level", "0..1", "supply", "of"]
        assert "  flip[=RATE]                               each bit" in str(chair)
        assert "0x6040" in drive.inputs
        assert "0x6040" not in str(drive)
        for name, one in (*drive.faults.items(), *chair.faults.items()):
            device = bench["drive" if name in drive.faults else "chair"]
            device.fault(f"{name}=rate=0.5" if one.rated else name)
            device.clear(name)
        for name, one in everything.faults.items():
            bench.fault(f"{name}=rate=0.5" if one.rated else name)
            bench.clear(name)


def test_known_are_all_faults_that_are_accepted() -> None:
    with Bench(drive="epos", chair="rrc") as bench:
        for device in (bench["drive"], bench["chair"], bench):
            with pytest.raises(ValueError, match="no fault 'x'") as caught:
                device.fault("x")
            assert str(caught.value).endswith(near("x", device.describe().faults))


def test_what_is_so_for_one_look_ends_a_wait() -> None:
    with Bench(Rrc()) as bench:
        looks = iter([False] * 20 + [True])
        assert bench.wait_until(lambda: next(looks, False), within="1s")
        assert next(looks, None) is None


def test_waiting_in_vain_takes_exactly_the_time() -> None:
    with Bench(Rrc()) as bench:
        assert not bench.wait_until(lambda: False, within="123ms")
        assert bench.now_us == 123_000


def test_a_button_is_let_go_whoever_makes_time_pass() -> None:
    with Bench(Rrc()) as bench:
        bench.run_for("1s")
        bench.press("power_button", for_="50ms")
        link = bench.link
        while link.receive(100_000):
            pass
        assert bench.get("power_button") == 0
        assert "1.060000 rrc ! power_button=0" in bench.transcript()


def test_a_group_takes_a_list_as_in_a_rig_file() -> None:
    with Bench("rrc") as bench:
        bench.set("stick", [50, -20])
        bench.set("gauge", (3,))
        assert [bench.get(name) for name in ("stick_v_pct", "stick_w_pct", "gauge")] == [50, -20, 3]


def test_a_group_is_set_at_once() -> None:
    with Bench(Rrc()) as bench:
        bench.set("stick", 100, -20)
        assert (bench.get("stick_v_pct"), bench.get("stick_w_pct")) == (100, -20)


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda bench: bench.set("stik", 1), "no input 'stik'; did you mean 'stick'?"),
        (lambda bench: bench.set("state", 1), "state is an output: it can be read, not set"),
        (lambda bench: bench.get("nothing"), "no input or output .*nothing.*; known: .*state"),
        (lambda bench: bench.get("stick"), "stick can only be set; read stick_v_pct, stick_w_pct"),
        (lambda bench: bench.press("state"), "no button 'state'; known: .*power_button"),
        (lambda bench: bench.fault("smoke"), "no fault 'smoke'; known: .*cut"),
        (lambda bench: bench.run_for("soon"), "'soon' is not a time"),
        (lambda bench: bench.run_for(-1), "a duration is not negative, got -1 us"),
        (lambda bench: bench.on_line("OK", nth=0), "nth counts from 1, got 0"),
        (
            lambda bench: bench.fault("cut@1s", when=lambda: True),
            "cut@1s: it waits for something, so it has no time; see for_",
        ),
        (lambda bench: bench.fault("other/cut"), "no fault 'other/cut'"),
        (lambda bench: bench.can_bus(), "rrc is a serial line, not a CAN bus"),
    ],
)
def test_what_cannot_be_is_told(act, text: str) -> None:  # type: ignore[no-untyped-def]
    with Bench(Rrc()) as bench, pytest.raises(ValueError, match=text):
        act(bench)


def test_actions_stand_in_order_of_time() -> None:
    with Bench(a=make_epos(1), b=make_f_palette(5)) as bench:
        bench.run_for("100200us")
        bench["b"].fault("power_off")
        bench.link.send((CanFrame.parse("601#4000100000000000"),))
        bench.run_for("50ms")
        lines = bench.transcript().splitlines()[2:]
    assert [" ".join(line.split()[:4]) for line in lines] == [
        "0.100321 can < 601#4000100000000000",
        "0.101000 b ! power_off=1",
        "0.101117 can < 581#4300100092010200",
    ]
    assert [line.number for line in bench._mode.journal()] == [1, 2, 3, 4, 5]


def test_a_fault_comes_some_time_from_now_on() -> None:
    with Bench(Rrc()) as bench:
        bench.run_for("1s")
        bench.fault("cut@+100ms-+300ms")
        bench.run_for("1s")
        cuts = [line for line in bench.transcript().splitlines() if " ! cut" in line]
        assert cuts == ["1.100000 rrc ! cut", "1.300000 rrc ! cut=0"]


def test_a_fault_comes_with_a_line() -> None:
    with Bench(Rrc()) as bench, RrcClient(bench.link) as client:
        client.start()
        bench.press("power_button")
        bench.wait_until(lambda: bench.get("state") == "Standby", within="2s")
        bench.fault("bus_unplugged", when=bench.on_line("OK:output", nth=2), for_="5ms")
        client.output(30, 0, confirm=True)
        assert bench.get("bus_unplugged") == 0
        client.output(30, 0, confirm=True)
        assert bench.get("bus_unplugged") == 1
        bench.run_for("20ms")
        assert bench.get("bus_unplugged") == 0


def test_a_fault_comes_with_a_state() -> None:
    with Bench(Rrc()) as bench:
        bench.fault("vr2_fault", when=lambda: bench.get("state") == "Standby")
        bench.run_for("1s")
        bench.press("power_button")
        assert bench.wait_until(lambda: bench.get("vr2_fault") == 1, within="2s")
        assert bench.get("state") == "Standby"


def test_a_fault_of_the_line_is_on_the_line() -> None:
    with Bench(Rrc()) as bench:
        bench.fault("cut@0s-2s")
        link = bench.link
        assert link.receive(1_000_000) == b""
        bench.run_for("1s")
        link.send(b"hello\n")
        assert link.receive(100_000).startswith(b"ER:")


def test_a_twin_goes_on_by_itself() -> None:
    with Bench(Rrc()) as bench:
        bench.run_for("1s")
        bench.press("power_button", for_="500ms")
        twin = bench.fork()
        twin.run_for("1s")
        assert (twin.get("power_button"), twin.now_us) == (0, 2_000_000)
        assert (bench.get("power_button"), bench.now_us) == (1, 1_000_000)
        bench.run_for("1s")
        assert bench.transcript().endswith(twin.transcript())


def test_several_devices_have_names() -> None:
    with Bench(left=make_epos(1), right=make_epos(2), panel=Rrc()) as bench:
        bench.run_for("100ms")
        bench["left"].fault("power_off")
        bench.run_for("10ms")
        assert (bench["left"].get("state"), bench.get("right/state")) == ("Off", "Pre-operational")
        assert bench["panel"].link.receive(0) == b"EV:Initialized\n"
        with pytest.raises(TypeError, match=r"an input is set by a call: bench.set\('x', 1\)"):
            bench["x"] = 1
        with pytest.raises(KeyError, match="no device 'middle'; known: left, right, panel"):
            bench["middle"]
        with pytest.raises(ValueError, match="several wires"):
            _ = bench.link


def test_a_fault_of_a_bus_is_had_from_each_of_its_nodes() -> None:
    with Bench(left=make_epos(1), panel=Rrc()) as bench:
        bench["left"].fault("short")
        bench["panel"].fault("cut")
        bench.run_for("100ms")
        assert "can ! short" in bench.transcript()
        assert "701#00" not in bench.transcript()


def test_masters_meet_a_node() -> None:
    with Bench(make_f_palette(5)) as bench:
        bus = bench.can_bus()
        boot_up = bus.recv(1.0)
        assert boot_up is not None
        assert (boot_up.arbitration_id, bytes(boot_up.data)) == (0x705, b"\0")
        network = bench.canopen_network()
        network.nmt.state = "OPERATIONAL"
        assert bench.wait_until(lambda: bench.get("state") == "Operational", within="10ms")
        bus.shutdown()
        network.disconnect()


def test_a_type_is_known_by_its_name() -> None:
    with Bench("rtc-lite") as bench:
        bench.run_for("1s")
        assert bench.devices == ("rtc_lite",)


def test_a_run_is_saved(tmp_path: Path) -> None:
    trace = tmp_path / "run.trace"
    with Bench(Rrc(RrcConfig(power_on_ticks=5)), left=make_epos(1), seed=3) as bench:
        bench["rrc"].press("power_button")
        bench["rrc"].fault("flip=0.01@1s-2s")
        bench["rrc"].link.send(b"status\n")
        bench["left"].fault("power_off", when=lambda: bench.now_us > 1_500_000)
        bench["left"].canopen_network().nmt.state = "OPERATIONAL"
        bench.run_for("3s")
        bench.save_trace(trace)
    text = trace.read_text("ascii")
    assert '"power_on_ticks": 5' in text
    assert " left ! power_off=1" in text
    assert " rrc ~ flip=0.01" in text


def test_power_is_switched_whatever_its_input_is_called() -> None:
    with Bench(drive=make_epos(1), panel=Rrc(), range="urg") as bench:
        bench.run_for("100ms")
        bench.switch_off()
        bench.run_for("20ms")
        assert (bench["drive"].get("state"), bench["panel"].get("state")) == ("Off", "Off")
        assert bench["range"].get("power_cut") == 1
        bench["drive"].switch_on()
        assert bench.wait_until(lambda: bench["drive"].get("state") == "Pre-operational", "1s")
        assert bench["panel"].get("rrc_power") == 0


def test_what_is_seen_is_looked_for_as_long_as_it_may_take() -> None:
    with Bench(Rrc()) as bench:
        assert bench.observe("the RRC waits", lambda: bench.get("state") == "WaitPowerOn")
        assert not bench.observe("VR2 runs", lambda: bench.get("vr2_power") == 1, within="20ms")
        assert bench.tolerance.time_us == bench.tolerance.stick_pct == 0


class OwnHost:
    """Somebody's host: it knows pyserial, and gives up after a time-out inside a line."""

    def __init__(self, port: serial.SerialBase) -> None:
        self.port = port

    def device(self) -> bytes:
        self.port.write(b"device\n")
        self.port.read_until(b"OK:device\n")
        return bytes(self.port.readline())


@pytest.mark.parametrize("mode", ["virtual", pytest.param("real", marks=pytest.mark.realtime)])
def test_a_host_of_pyserial_is_given_a_port_or_opens_it_itself(mode: str) -> None:
    with Bench(Rrc(), mode=mode) as bench:
        port = bench.serial(timeout=1)
        assert OwnHost(port).device() == b"RRC\n"
        port.close()
        with serial.serial_for_url(bench.url, 115_200, timeout=1) as own:
            assert OwnHost(own).device() == b"RRC\n"


def test_a_time_out_passes_in_the_time_of_the_bench() -> None:
    with Bench(Rrc()) as bench:
        bench.fault("cut")
        assert OwnHost(bench.serial(timeout=0.25)).device() == b""
        assert bench.now_us == 500_000


@pytest.mark.parametrize("mode", ["virtual", pytest.param("real", marks=pytest.mark.realtime)])
def test_a_master_of_python_can_opens_the_bus_itself(mode: str) -> None:
    with Bench(make_f_palette(5), mode=mode) as bench, can.Bus(**bench.bus_options) as bus:
        bus.send(can.Message(arbitration_id=0, data=b"\x81\x05", is_extended_id=False))
        while (message := bus.recv(2)) is not None and message.arbitration_id != 0x705:
            pass
        assert message is not None
        assert bytes(message.data) == b"\0"


def test_two_benches_have_addresses_of_their_own() -> None:
    with Bench(Rrc()) as first, Bench(Rrc()) as second:
        assert (first.url, second.url) == ("tickrig://rrc", "tickrig://rrc-2")
    with Bench(Rrc()) as third:
        assert third.url == "tickrig://rrc"
        with pytest.raises(ValueError, match="rrc is a serial line, which has no bus: see url"):
            third.bus_options  # noqa: B018 - it is what is asked


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda bench: bench.run_for(1.5), '1.5 is not a time: write "1.5s", or whole micro'),
        (lambda bench: bench.fault("cut", for_=0.5), "0.5 is not a time"),
        (lambda bench: bench.wait_until(True, "1s"), "True cannot be waited for: give a function"),
        (lambda bench: bench.fault("cut", when="OK"), "'OK' cannot be waited for: give a function"),
    ],
)
def test_what_is_of_another_type_is_told(act, text: str) -> None:  # type: ignore[no-untyped-def]
    with Bench(Rrc()) as bench, pytest.raises(TypeError, match=text):
        act(bench)


def test_names_of_a_lone_device_may_have_it_before_them() -> None:
    with Bench(chair=Rrc()) as bench:
        bench.set("chair/stick", 10, 0)
        bench.fault("chair/cut")
        assert bench.get("chair/stick_v_pct") == bench["chair"].get("stick_v_pct") == 10
        assert "chair ! cut" in bench.transcript()
        bench.clear("chair/cut")
    with Bench(left=make_epos(1), right=make_epos(2)) as bench:
        bench.fault("left/short")
        bench.clear("can/short")


def test_no_time_passes_on_a_bench_that_is_closed() -> None:
    bench = Bench(Rrc())
    bench.close()
    with pytest.raises(BenchError, match="the bench is closed: no time passes"):
        bench.run_for("1s")


def test_a_condition_that_takes_what_it_sees_is_true_once_and_that_is_enough() -> None:
    with Bench(Rrc()) as bench:
        host = bench.link  # EV:Initialized comes
        assert bench.wait_until(lambda: bool(host.receive(0)), within="1s")
        assert bench.now_us < 100_000


def test_a_snapshot_puts_the_bench_back_with_its_links() -> None:
    with Bench(Rrc()) as bench:
        link = bench.link
        bench.run_for("1s")
        snapshot = bench.snapshot()
        runs = set()
        for _ in range(3):
            snapshot.restore()
            bench.press("power_button")
            bench.fault("cut@1200ms-1300ms")
            trigger = bench.on_line("EV:*")
            link.send(b"device\n")
            bench.run_for("1s")
            assert trigger.count == 2
            runs.add((link.receive(0), bench.transcript(), bench.get("state")))
        assert len(runs) == 1


def test_a_snapshot_takes_back_what_was_offered_since() -> None:
    with Bench("rrc") as bench:
        url, snapshot = bench.url, bench.snapshot()
        snapshot.restore()
        assert bench.url == url == "tickrig://rrc"
        assert "rrc" in SERIAL_PORTS.names
    with Bench("rrc") as bench:
        snapshot = bench.snapshot()
        for _ in range(2):
            with serial.serial_for_url(bench.url) as port:
                assert port.port == "tickrig://rrc"
            snapshot.restore()
        assert "rrc" not in SERIAL_PORTS.names


def test_a_host_is_put_back_with_its_bench() -> None:
    with Bench(drive=make_epos(1)) as bench, bench.can_bus() as bus:
        seen: list[object] = []
        snapshot = bench.snapshot(bus, seen)
        for _ in range(2):
            snapshot.restore()
            assert seen == []
            seen.append(bus.recv(1))
            assert [message.arbitration_id for message in seen] == [0x701]  # type: ignore[attr-defined] # one came


@pytest.mark.realtime
def test_real_time_does_not_come_back() -> None:
    with (
        Bench("rrc", mode="real") as bench,
        pytest.raises(NotOnThisBench, match="time that has passed comes back in virtual time"),
    ):
        bench.snapshot()


def test_a_time_as_text_has_its_unit() -> None:
    with Bench("rrc") as bench:
        with pytest.raises(ValueError, match="'5' has no unit: write 5s, 5ms or 5us"):
            bench.run_for("5")
        with pytest.raises(ValueError, match="'5' has no unit: write 5s, 5ms or 5us"):
            bench.press("power_button", for_="5")
        assert bench.now_us == 0


def test_a_cancelled_fault_is_not_watched_any_more() -> None:
    with Bench("rrc") as bench:
        asked: list[int] = []

        def never() -> bool:
            asked.append(bench.now_us)
            return False

        before = bench._mode.act(lambda rig: len(rig.rig.watchers))
        bench.fault("vr2_fault", when=never)
        bench.run_for("5ms")
        bench.clear("vr2_fault")
        count = len(asked)
        bench.run_for("20ms")
        assert (len(asked), bench.get("vr2_fault")) == (count, 0)
        assert bench._mode.act(lambda rig: len(rig.rig.watchers)) == before
