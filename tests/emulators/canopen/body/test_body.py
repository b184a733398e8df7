"""Rigs with a body: drives on a bus that move a robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.device.body import BodyParameters, WheeledBody
from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.body import BodyOnDrives, DrivenWheel
from tickrig.emulators.canopen.build import describe_nodes, make_bench, make_nodes
from tickrig.emulators.canopen.cli import main
from tickrig.emulators.canopen.node_spec import NodeSpec
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.commands.canopen_run import read_rig
from tickrig.wire.can import CanFrame

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
BEEGO, FOURX = RIGS / "beego.toml", RIGS / "fourx.toml"
RPM = 360 / 60 / 51
"""Degrees a second of a wheel of beego, by revolutions per minute of its motor."""

PROFILE_VELOCITY = ("60{}#2F60600003000000",)
ENABLE = ("20{}#060000000000", "20{}#070000000000")


def speed(rpm: int) -> str:
    return f"20{{}}#0F00{rpm.to_bytes(4, 'little', signed=True).hex()}"


class Robot:
    """A rig in virtual time."""

    def __init__(self, rig: Path) -> None:
        file, wire = read_rig(rig), CanWire()
        assert file.body is not None
        nodes = make_nodes(file.nodes, wire)
        self.bench: CanEmulator = make_bench(wire, nodes, [file.body.put_on(nodes)])
        self.nodes = [str(node.slave.configured_id) for node in nodes]
        self.run(5)

    def run(self, duration_ms: int) -> None:
        self.bench.rig.run_for(duration_ms * 1_000)

    def send(self, *frames: str, pause_ms: int = 3) -> None:
        for frame in frames:
            self.bench.send(self.bench.rig.now_us, frame.encode())
            self.run(pause_ms)

    def set(self, name: str, *values: float) -> None:
        self.bench.operator.set(name, *values)

    def __getitem__(self, name: str) -> float:
        value = self.bench.device.read(name)
        assert not isinstance(value, str)
        return value

    def enable(self) -> None:
        self.send("000#0100")
        for frame in (*PROFILE_VELOCITY, *ENABLE):
            self.send(*(frame.format(node) for node in self.nodes))

    def drive(self, *rpm: int) -> None:
        self.send(*(speed(x).format(n) for n, x in zip(self.nodes, rpm, strict=True)), pause_ms=0)


def variant(path: Path, tmp_path: Path, change: Callable[[str], str]) -> Path:
    rig = tmp_path / path.name
    rig.write_text(change(path.read_text("utf-8")))
    return rig


def test_beego_drives_straight_on_in_profile_velocity_mode() -> None:
    beego = Robot(BEEGO)
    beego.enable()
    beego.drive(3000, 3000)
    beego.run(1000)
    assert beego["body/speed_m_s"] == pytest.approx(3000 * RPM / 180 * pi * 0.078, rel=0.01)
    way = beego["left/shaft_deg"] / 180 * pi * 0.078
    assert beego["body/x_m"] == pytest.approx(way, rel=1e-6)
    assert abs(beego["body/y_m"]) < 0.01


def test_beego_turns_on_the_spot() -> None:
    beego = Robot(BEEGO)
    beego.enable()
    beego.drive(-1000, 1000)
    beego.run(800)
    turn = (beego["right/shaft_deg"] - beego["left/shaft_deg"]) * 0.078 / 0.33
    assert beego["body/heading_deg"] == pytest.approx(turn, rel=1e-6)
    assert beego["body/turn_deg_s"] == pytest.approx(2000 * RPM * 0.078 / 0.33, rel=0.01)
    assert (beego["body/x_m"], beego["body/y_m"]) == pytest.approx((0, 0), abs=1e-3)


def test_fourx_goes_as_the_mean_of_each_side() -> None:
    fourx = Robot(FOURX)
    fourx.send("000#0100")
    fourx.send(*(f"60{n}#2F00200002000000" for n in fourx.nodes))
    half = (16384).to_bytes(2, "little").hex()  # of 360 deg/s
    fourx.send(f"301#{half}0000FF7F0000", f"303#{half}0000FF7F0000", pause_ms=0)
    fourx.send(f"302#{half}0000FF7F0000", f"304#{half}0000FF7F0000", pause_ms=0)
    fourx.run(500)
    assert fourx["body/speed_m_s"] == pytest.approx(pi * 0.1, rel=0.01)
    fourx.send("301#00000000FF7F0000", pause_ms=0)
    fourx.run(500)
    assert fourx["body/speed_m_s"] == pytest.approx(0.75 * pi * 0.1, rel=0.01)
    assert fourx["body/turn_deg_s"] == pytest.approx(90 * 0.1 / 0.4, rel=0.02)


def test_a_heavier_body_takes_more_current(tmp_path: Path) -> None:
    def current(mass: str) -> float:
        rig = variant(BEEGO, tmp_path, lambda text: text.replace("mass_kg = 8.0", mass))
        beego = Robot(rig)
        beego.enable()
        beego.drive(3000, 3000)
        beego.run(100)
        return beego["left/current_a"]

    assert 0 < current("") < current("mass_kg = 8") < current("mass_kg = 16")


def test_a_body_is_put_where_it_shall_be() -> None:
    beego = Robot(BEEGO)
    beego.set("body/pose", 1, -2, 90)
    inputs = beego.bench.device.inputs
    assert (inputs["body/x_m"], inputs["body/y_m"]) == (1, -2)
    assert beego["body/heading_deg"] == pytest.approx(90)
    beego.enable()
    beego.drive(1000, 1000)
    beego.run(500)
    assert beego["body/y_m"] > -1.95
    assert beego["body/x_m"] == pytest.approx(1, abs=0.01)
    with pytest.raises(ValueError, match=r"heading_deg 181 is not in -180..180 deg"):
        beego.set("body/heading_deg", 181)
    with pytest.raises(ValueError, match="no input 'body/friction'"):
        beego.set("body/friction", 1)


def test_a_wheel_slips_on_ice(tmp_path: Path) -> None:
    rig = variant(BEEGO, tmp_path, lambda text: text + "friction = 0.8\n")
    beego = Robot(rig)
    beego.enable()
    beego.drive(1000, 1000)
    beego.run(300)
    assert beego["body/slipping"] == 0
    beego.set("body/friction", 0.02)
    assert beego.bench.device.inputs["body/friction"] == 0.02
    beego.drive(6000, 6000)
    beego.run(300)
    rim_m_s = beego["left/shaft_deg_s"] / 180 * pi * 0.078
    assert beego["body/slipping"] == 1
    assert beego["body/speed_m_s"] < 0.5 * rim_m_s
    assert beego.bench.device.inputs["left/load_kg_m2"] == 0
    beego.set("body/friction", 1)
    beego.run(500)
    assert beego["body/slipping"] == 0


def test_a_mirrored_drive_turns_backwards_to_go_forward(tmp_path: Path) -> None:
    rig = variant(BEEGO, tmp_path, lambda text: text + 'mirrored = ["right"]\n')
    beego = Robot(rig)
    beego.enable()
    beego.drive(1000, -1000)
    beego.run(500)
    assert beego["body/x_m"] > 0.05
    assert beego["body/heading_deg"] == pytest.approx(0, abs=1)


def test_a_body_rolls_on_when_its_drives_lose_power() -> None:
    beego = Robot(BEEGO)
    beego.enable()
    beego.drive(3000, 3000)
    beego.run(500)
    for node in ("left", "right"):
        beego.set(f"{node}/power_off", 1)
    x_m, speed_m_s = beego["body/x_m"], beego["body/speed_m_s"]
    beego.run(20)
    assert 0.3 * 0.02 * speed_m_s < beego["body/x_m"] - x_m < 0.02 * speed_m_s
    beego.run(5000)
    assert beego["body/speed_m_s"] == 0


@pytest.mark.parametrize(
    ("model", "load", "angle"),
    [("epos", "load_nm", "shaft_deg"), ("motor-core-unit", "shaft_load_nm", "angle_deg")],
)
def test_a_shaft_without_power_turns_when_it_is_pushed(model: str, load: str, angle: str) -> None:
    wire = CanWire()
    bench = make_bench(wire, make_nodes(describe_nodes([NodeSpec(model, 1)]), wire))
    bench.operator.set("power_off", 1)
    bench.rig.run_for(50_000)
    assert bench.device.read(angle) == 0
    bench.operator.set(load, 10)
    bench.rig.run_for(50_000)
    pushed_deg = bench.device.read(angle)
    assert isinstance(pushed_deg, float)
    assert pushed_deg > 1
    bench.operator.set("power_off", 0)
    bench.rig.run_for(50_000)
    assert bench.device.read("state") == "Pre-operational"


def test_an_ideal_drive_of_an_eds_moves_a_body_too(tmp_path: Path) -> None:
    eds = RIGS.parent / "eds" / "epos.eds"
    rig = variant(BEEGO, tmp_path, lambda text: text.replace('"epos"', f'"{eds}"'))
    beego = Robot(rig)
    beego.enable()
    beego.drive(100_000, 100_000)
    beego.run(300)
    assert beego["body/x_m"] > 0.1


commands = st.lists(
    st.tuples(st.sampled_from("1234"), st.integers(-3000, 3000), st.integers(0, 200)), max_size=5
)


@settings(max_examples=6, deadline=None)
@given(commands, st.permutations(range(2)), st.sampled_from([None, 0.05]))
def test_a_run_does_not_depend_on_order_or_density(
    commands: list[tuple[str, int, int]], order: list[int], friction: float | None
) -> None:
    def seen(order: Sequence[int], *, dense: bool) -> list[object]:
        wire = CanWire()
        nodes = make_nodes(describe_nodes([NodeSpec("epos", 1), NodeSpec("epos", 2)]), wire)
        parameters = BodyParameters(
            kind="differential", wheel_radius_m=0.1, tread_m=0.4, mass_kg=8, friction=friction
        )
        wheels = [DrivenWheel("left", nodes[0]), DrivenWheel("right", nodes[1])]
        body = BodyOnDrives(WheeledBody(parameters), wheels)
        stations = [Station(nodes[number], nodes[number].port) for number in order]
        host = wire.end()
        rig = Rig(*stations, couplings=[body], dense=dense)
        log: list[object] = []
        wire.observers.append(lambda at_us, frame: log.append((at_us, str(frame))))
        rig.run_for(5_000)
        host.send(rig.now_us, (CanFrame.parse("000#0100"),))
        for node in "12":
            for frame in (*PROFILE_VELOCITY, *ENABLE):
                host.send(rig.now_us, (CanFrame.parse(frame.format(node)),))
                rig.run_for(3_000)
        for kind, rpm, pause_ms in commands:
            if kind in "12":
                host.send(rig.now_us, (CanFrame.parse(speed(rpm).format(kind)),))
            else:
                power = nodes[int(kind) - 3].physical["power_off"]
                power.write(1 - int(power.read()))
            rig.run_for(pause_ms * 1_000)
            log.append((body.body.pose, body.body.speed_m_s, body.body.slipping))
        rig.run_for(300_000)
        drives = [node.read("drive_state") for node in nodes if node.read("state") != "Off"]
        assert commands or drives == ["Switched on"] * 2
        return [*log, body.body.pose, [node.read("shaft_deg") for node in nodes]]

    assert seen(order, dense=False) == seen((0, 1), dense=True)


def play(rig: Path, scenario: str = "1ms end\n") -> Result:
    return CliRunner().invoke(main, ["--rig", str(rig), "--scenario", "-"], input=scenario)


@pytest.mark.parametrize("rig", [BEEGO, FOURX], ids=["beego", "fourx"])
def test_a_shipped_rig_runs_from_the_command_line(rig: Path) -> None:
    result = play(rig, "1ms watch body/x_m\n5ms set body/x_m 2.5\n10ms end\n")
    assert result.exit_code == 0, result.stderr
    assert "* body/x_m 2.5\n" in result.stderr


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ('"differential"', '"tricycle"', "13: body.kind: it takes differential, skid-steer"),
        ('right = "right"', 'right = "centre"', "15: body.right: no device 'centre'"),
        ("tread_m = 0.33", "", "12: body: no key 'tread_m'"),
        ('"epos"\nnode_id = 2', '"f-palette"\nnode_id = 2', "15: body.right: 'right' has no shaft"),
    ],
)
def test_a_wrong_body_is_one_line_and_status_2(
    tmp_path: Path, old: str, new: str, error: str
) -> None:
    rig = variant(BEEGO, tmp_path, lambda text: text.replace(old, new))
    result = play(rig)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1), result.stderr
    assert result.stderr.startswith(f"Error: {rig}:{error}")
