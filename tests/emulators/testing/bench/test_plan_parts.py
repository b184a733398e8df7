from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.emulators.bench.operator import FaultSpec
from tickrig.emulators.canopen.body import BodyPlan
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.rig_file.plan import (
    DeviceKind,
    DevicePlan,
    FaultPlan,
    RigPlan,
    WirePlan,
    WireType,
)
from tickrig.emulators.testing.signals.spec_reader import read_signal_spec
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.modbus import encode_frame, parse_frame


def plan_of(*devices: DevicePlan, wires: tuple[WirePlan, ...] = (), **more: object) -> RigPlan:
    named = {wire.name: wire for wire in wires}
    lines = {d.wire: WirePlan(name=d.wire, given=False) for d in devices if d.wire not in named}
    by_name = {device.name: device for device in devices}
    return RigPlan(wires={**named, **lines}, devices=by_name, **more)  # type: ignore[arg-type]


def drive(name: str, node_id: int, **more: object) -> DevicePlan:
    return DevicePlan(
        name=name,
        kind=DeviceKind.MODEL,
        type="epos",
        wire="bus",
        node_id=node_id,
        **more,  # type: ignore[arg-type]
    )


BUS = WirePlan(name="bus", type=WireType.CAN, bit_rate=500_000)


def test_devices_begin_as_the_file_says() -> None:
    rrc = DevicePlan(name="joy", kind=DeviceKind.SERIAL, type="rrc", wire="joy")
    faults = (
        FaultPlan("joy", FaultSpec("cut", (), 0, 2_000_000)),
        FaultPlan("left", FaultSpec("power_off", (), 50_000)),
    )
    left = drive("left", 5, start={"load_nm": 0.25})
    plan = plan_of(rrc, left, drive("right", 6), wires=(BUS,), faults=faults)
    with Bench.of_plan(plan) as bench:
        assert bench["left"].get("load_nm") == 0.25
        bench.run_for("100ms")
        assert (bench["left"].get("state"), bench["right"].get("state")) == (
            "Off",
            "Pre-operational",
        )
        assert bench["joy"].link.receive(1_000_000) == b""
        assert "bus < 705#00" in bench.transcript()


def test_a_type_takes_its_options() -> None:
    lite = DevicePlan(
        name="pic", kind=DeviceKind.SERIAL, type="rtc-lite", wire="pic", config={"node": "lite-a"}
    )
    with Bench.of_plan(plan_of(lite)) as bench:
        bench.run_for("100ms")
    wrong = DevicePlan(
        name="pic", kind=DeviceKind.SERIAL, type="rtc-lite", wire="pic", config={"nod": "lite-a"}
    )
    with pytest.raises(ValueError, match="nod: rtc-lite has no such option"):
        Bench.of_plan(plan_of(wrong))


def test_two_bases_share_an_rs485_line() -> None:
    bases = [
        DevicePlan(
            name=name,
            kind=DeviceKind.SERIAL,
            type="rh3-base",
            wire="pair",
            config={"address": address},
        )
        for name, address in (("front", 1), ("rear", 2))
    ]
    pair = WirePlan(name="pair", type=WireType.RS485, bit_rate=115_200)
    with Bench.of_plan(plan_of(*bases, wires=(pair,))) as bench:
        link = bench.link
        for address in (1, 2):
            link.send(encode_frame(address, bytes.fromhex("03 00 00 00 01")))
            bench.run_for("50ms")
            assert parse_frame(link.receive(0))[0] == address


def test_an_eds_becomes_a_node(tmp_path: Path) -> None:
    description = MODELS["f-palette"].describe()
    path = tmp_path / "io.eds"
    path.write_text(write_eds(description.template.description, description.info), "ascii")
    io = DevicePlan(name="io", kind=DeviceKind.EDS, type=str(path), wire="bus", node_id=9)
    with Bench.of_plan(plan_of(io, wires=(BUS,))) as bench:
        assert bench.wait_until(bench.on_line("709#00"), within="10ms")
    lost = DevicePlan(name="io", kind=DeviceKind.EDS, type="lost.eds", wire="bus", node_id=9)
    with pytest.raises(ValueError, match="No such file"):
        Bench.of_plan(plan_of(lost, wires=(BUS,)))


def test_drives_move_a_body() -> None:
    body = BodyPlan(
        kind="differential",
        drives={"left": "left", "right": "right"},
        mirrored=("right",),
        parameters={"wheel_radius_m": 0.1, "tread_m": 0.4},
    )
    plan = plan_of(drive("left", 5), drive("right", 6), wires=(BUS,), body=body)
    with Bench.of_plan(plan) as bench:
        bench.run_for("10ms")
        assert bench["body"].get("x_m") == 0
        bench["body"].set("x_m", 2.5)
        assert bench.get("body/x_m") == 2.5
        twin = bench.fork()
        twin["body"].set("x_m", 1)
        assert bench["body"].get("x_m") == 2.5


def test_what_a_node_stored_is_there_again(tmp_path: Path) -> None:
    store = tmp_path / "store.json"
    plan = plan_of(drive("left", 5, store=store), wires=(BUS,))
    with Bench.of_plan(plan) as bench:
        node = bench.canopen_network().add_node(5)
        bench.run_for("10ms")
        node.sdo.download(0x1017, 0, (250).to_bytes(2, "little"))
        node.sdo.download(0x1010, 1, b"save")
    with Bench.of_plan(plan) as bench:
        bench.run_for("10ms")
        assert bench.get("0x1017") == 250


def test_inputs_follow_signals() -> None:
    load = read_signal_spec({"ramp": [0.0, 0.2], "over": "1s"})
    half = read_signal_spec({"formula": "torque / 2"})
    plan = plan_of(
        drive("left", 5, start={"load_nm": half}), wires=(BUS,), signals={"torque": load}
    )
    with Bench.of_plan(plan) as bench:
        bench.run_for("500ms")
        assert bench.get("load_nm") == pytest.approx(0.05, abs=1e-3)
        twin = bench.fork()
        twin.run_for("1s")
        assert (twin.get("load_nm"), bench.now_us) == (0.1, 500_000)
