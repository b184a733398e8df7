from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.emulators.bench.operator import FaultSpec
from tickrig.emulators.canopen.body import BodyPlan
from tickrig.emulators.testing.rig_file.plan import (
    BusPlan,
    DeviceKind,
    DevicePlan,
    DoorPlan,
    FaultPlan,
    PortPlan,
    PowerPlan,
    RigFileError,
    RigPlan,
    Tolerances,
    WirePlan,
    WireType,
)
from tickrig.emulators.testing.rig_file.reader import parse_rig_file, read_rig_file
from tickrig.emulators.testing.signals.sources import SignalSpec

ROOT = Path(__file__).parents[4]
HERE = Path("bench") / "rig.toml"

WHOLE = """\
seed = 3

[wire.can0]
type = "can"
bitrate = 500000

[wire.rs]
type = "rs485"
baud = 57600
framing = "8E1"
echo = true

[device.left]
type = "epos"
node_id = 1
store = "left.json"

[device.right]
type = "epos"
node_id = 2
wire = "can0"
start = { load_nm = { ramp = [0, 1], over = "2s" }, "0x6081" = 5 }

[device.vr2]
type = "rrc"
start.stick = [100, -20]

[device.base]
type = "rh3-base"
wire = "rs"

[device.lidar]
type = "urg"
config = { room = "4,3", post = ["1,0.5,0.1"] }

[signal.load]
formula = "left.load_nm * 2"

[fault]
left = "shaft_blocked@2s-3s"
can0 = ["drop=0.1@1s-2s"]
vr2 = "cut"

[body]
kind = "differential"
left = "left"
right = 2
wheel_radius_m = 0.1
tread_m = 0.3
mirrored = ["right"]

[real]
control = "/tmp/bench.ctl"
[real.vr2]
link = "/tmp/rrc"
serve = "rfc2217://7000"
[real.can0]
interface = "socketcan"
channel = "vcan0"

[hardware]
control = "bench.ctl"
[hardware.vr2]
port = "/dev/ttyACM0"
baud = 9600
control = "vr2.ctl"
power_on = "switch -n 'socket 1' on"
power_off = ["switch", "off"]
[hardware.rs]
port = "COM3"
[hardware.can0]
interface = "slcan"
channel = "/dev/ttyUSB0"
bitrate = 500000
options = { sleep_after_open = 0.1 }
[hardware.tolerance]
stick_pct = 5
time_ms = 20
"""


def read(text: str) -> RigPlan:
    return parse_rig_file(text, HERE)


def mistakes(text: str) -> list[str]:
    """Return what is wrong with a file, each as LINE: REASON."""
    with pytest.raises(RigFileError) as caught:
        read(text)
    assert all(line.startswith(f"{HERE}:") for line in str(caught.value).split("\n"))
    return [f"{line}: {reason}" for line, reason in caught.value.mistakes]


def test_the_wires_are_those_of_the_file_and_those_that_it_leaves_out() -> None:
    assert list(read(WHOLE).wires.values()) == [
        WirePlan(name="can0", type=WireType.CAN, bit_rate=500_000),
        WirePlan(name="rs", type=WireType.RS485, bit_rate=57_600, framing="8E1", echo=True),
        WirePlan(name="vr2", given=False),
        WirePlan(name="lidar", given=False),
    ]


def test_the_devices_are_on_their_wires() -> None:
    devices = read(WHOLE).devices
    assert {name: device.wire for name, device in devices.items()} == {
        "left": "can0",
        "right": "can0",
        "vr2": "vr2",
        "base": "rs",
        "lidar": "lidar",
    }
    assert devices["left"] == DevicePlan(
        name="left",
        kind=DeviceKind.MODEL,
        type="epos",
        wire="can0",
        node_id=1,
        store=Path("bench/left.json"),
    )
    assert devices["lidar"].config == {"room": "4,3", "post": ["1,0.5,0.1"]}


def test_starts_are_values_and_signals_by_the_name_of_the_input() -> None:
    devices = read(WHOLE).devices
    assert devices["vr2"].start == {"stick_v_pct": 100, "stick_w_pct": -20}
    load, acceleration = devices["right"].start.values()
    assert isinstance(load, SignalSpec)
    assert acceleration == 5
    assert list(read(WHOLE).signals) == ["load"]


def test_faults_body_and_doors_are_read() -> None:
    plan = read(WHOLE)
    assert plan.faults == (
        FaultPlan("left", FaultSpec("shaft_blocked", (), 2_000_000, 3_000_000)),
        FaultPlan("can0", FaultSpec("drop", ("0.1",), 1_000_000, 2_000_000)),
        FaultPlan("vr2", FaultSpec("cut")),
    )
    assert plan.body == BodyPlan(
        kind="differential",
        drives={"left": "left", "right": "right"},
        mirrored=("right",),
        parameters={"wheel_radius_m": 0.1, "tread_m": 0.3},
    )
    assert plan.real.control == Path("/tmp/bench.ctl")
    assert plan.real.doors == {
        "vr2": DoorPlan(link=Path("/tmp/rrc"), serve=("rfc2217://7000",)),
        "can0": DoorPlan(bus=BusPlan(interface="socketcan", channel="vcan0")),
    }


def test_hardware_is_read() -> None:
    hardware = read(WHOLE).hardware
    assert hardware is not None
    assert hardware.control["vr2"] == Path("bench/vr2.ctl")
    assert hardware.control["left"] == Path("bench/bench.ctl")
    assert hardware.ports == {
        "vr2": PortPlan(port="/dev/ttyACM0", baud=9_600),
        "rs": PortPlan(port="COM3"),
    }
    assert hardware.buses["can0"] == BusPlan(
        interface="slcan",
        channel="/dev/ttyUSB0",
        bit_rate=500_000,
        options={"sleep_after_open": 0.1},
    )
    assert hardware.power == {
        "vr2": PowerPlan(on=("switch", "-n", "socket 1", "on"), off=("switch", "off"))
    }
    assert hardware.tolerance == Tolerances(stick_pct=5, time_us=20_000)


def test_a_device_is_enough() -> None:
    plan = read('[device.rrc]\ntype = "rrc"\n')
    assert (plan.seed, plan.hardware, plan.path) == (0, None, HERE)
    assert plan.devices_on("rrc") == (
        DevicePlan(name="rrc", kind=DeviceKind.SERIAL, type="rrc", wire="rrc"),
    )


def test_files_are_looked_for_beside_the_rig_file(tmp_path: Path) -> None:
    eds = (ROOT / "examples" / "io_module.eds").read_bytes()
    (tmp_path / "module.eds").write_bytes(eds)
    rtc = (ROOT / "examples" / "device_rtc_gripper.py").read_text("utf-8")
    (tmp_path / "gripper.py").write_text(rtc)
    file = tmp_path / "rig.toml"
    file.write_text(
        '[device.module]\ntype = "module.eds"\nnode_id = "lss"\nprofile = "401"\n'
        '[device.gripper]\ntype = "gripper.py:Gripper"\nnode_id = 9\n'
    )
    devices = read_rig_file(file).devices
    assert devices["module"] == DevicePlan(
        name="module",
        kind=DeviceKind.EDS,
        type=str(tmp_path / "module.eds"),
        wire="can",
        node_id=UNCONFIGURED,
        profile="401",
    )
    assert (devices["gripper"].kind, devices["gripper"].type) == (
        DeviceKind.DEVICE_RTC,
        str(tmp_path / "gripper.py:Gripper"),
    )


def test_a_wrong_node_id_is_not_a_missing_one() -> None:
    text = '[device.a]\ntype = "io_module.eds"\nprofile = "401"\n'
    rig = ROOT / "examples" / "rig.toml"
    for given, expected in (("node_id = 300", "it takes 1..127"), ("", "no key 'node_id'")):
        with pytest.raises(RigFileError) as caught:
            parse_rig_file(text + given, rig)
        (mistake,) = caught.value.mistakes
        assert expected in mistake.reason


RRC = '[device.rrc]\ntype = "rrc"\n'
NODE = '[device.node]\ntype = "epos"\nnode_id = 5\n'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ["1: no device: a rig file has tables [device.NAME] with a type"]),
        ("[device]", ["1: no device: a rig file has tables [device.NAME]"]),
        ("device = 5", ["1: device: it is a table [device], not 5"]),
        ('[device.a]\ntpye = "rrc"', ["2: device.a: no key 'tpye'; did you mean 'type'?"]),
        ("[device.a]\nwire = 'x'", ["1: device.a: no key 'type': what it is", "2: .*no wire 'x'"]),
        ('[device.a]\ntype = "rcr"', ["2: device.a.type: no device 'rcr'; did you mean 'rrc'?"]),
        ("[device.a]\ntype = 5", ["2: device.a.type: it takes a text, not 5"]),
        ("device.a = 5", ["1: device.a: it is a table [device.a], not 5"]),
        ('[device.a-b]\ntype = "rrc"', ["1: .*a name is letters, digits and _.*, as a_b"]),
        (f'[device.{"a" * 41}]\ntype = "rrc"', ["1: .*a name of 41 letters; 40 are enough"]),
        ('[device.can]\ntype = "rrc"', ["1: device.can: control, .* are no names of devices"]),
        (RRC + "node_id = 5", ["3: device.rrc: no key 'node_id'; known: type, wire,"]),
        (RRC + 'profile = "402"', ["3: device.rrc: no key 'profile'; "]),
        (RRC + "[safe]\nrcr = {}", ["4: safe.rcr: no device 'rcr'; did you mean 'rrc'?"]),
        (RRC + "[safe]\nrrc = 5", ["4: safe.rrc: it is a table [safe.rrc], not 5"]),
        (RRC + "safe = 5", ["3: .*no key 'safe'"]),
        (
            RRC + "[safe.rrc]\nout_v = 0\nout_w_pct = []\nstate = 0\nout_v_pct = 'x'",
            [
                "4: safe.rrc.out_v: no output 'out_v'; did you mean 'out_v_pct'?",
                "5: safe.rrc.out_w_pct: it takes a number or a text, not a list",
                "6: safe.rrc.state: it is a text, not 0",
                "7: safe.rrc.out_v_pct: it is a number, not 'x'",
            ],
        ),
        (NODE + 'profile = "402"', ["4: device.node.profile: it belongs to an EDS or DCF"]),
        (NODE + "config = {}", ["4: device.node: no key 'config'; "]),
        (NODE + "sdo_timeout = 5", ['4: device.node.sdo_timeout: it takes a time as "500ms"']),
        (NODE + "sdo_timeout = '5'", ["4: device.node.sdo_timeout: '5' has no unit"]),
        (NODE + "sdo_timeout = '0s'", ["4: device.node.sdo_timeout: .* above 0, not '0s'"]),
        (NODE + "sdo_memory = '5X'", ["4: device.node.sdo_memory: '5X' is not a size"]),
        (NODE + "sdo_memory = -1", ["4: device.node.sdo_memory: it takes bytes as 4096"]),
        (RRC + "sdo_timeout = '1s'", ["3: device.rrc: no key 'sdo_timeout'; "]),
        (RRC + "[fault]\nrrc = 'cutt=x@2s-1s'", ["4: .*no fault 'cutt'; did you mean 'cut'?"]),
        (NODE + "[fault]\ncan = 'drp@x'", ["5: .*no fault 'drp'; did you mean 'drop'?"]),
        (NODE.replace("5", "0"), ["3: device.node.node_id: it takes 1..127, or lss"]),
        (NODE + NODE.replace("node]", "b]"), ["6: .*node-ID 5 is that of 'node' already"]),
        ('[device.a]\ntype = "x.eds"', ["2: .*x.eds: No such file"]),
        (f'[device.a]\ntype = "{"x" * 999}.eds"', ["2: device.a.type: file .*xxx..."]),
        ('[device.a]\ntype = "x.py:A"', ["2: .*x.py: No such file"]),
        ('[device.a]\ntype = "x\\u0000.eds"', ["2: device.a.type: no device"]),
        ('[device.a]\ntype = "urg"\nconfig.rom = 1', ["3: .*no option 'rom'; .*'room'?"]),
        ('[device.a]\ntype = "urg"\nconfig.noise = 2', ["3: device.a.config.noise: .*2.0 is not"]),
        (
            '[device.a]\ntype = "urg"\nconfig.noise = 2\nconfig.room = "x"',
            ["3: device.a.config.noise", "4: device.a.config.room"],
        ),
        (RRC + "wire = 'l'\n[wire.l]\ntype = 'can'", ["3: .*'l' is of type can, and this a dev"]),
        (NODE + "wire = 'l'\n[wire.l]\ntype = 'serial'", ["4: .*'l' is of type serial, .*CANopen"]),
        (RRC + "[wire.l]\ntype = 'can'", ["3: wire.l: no device is on it"]),
        ("[wire.l]\ntype = 'cna'\n" + RRC, ["2: wire.l.type: it takes serial, rs485, can, not"]),
        ("[wire.l]\ntype = 'can'\nbaud = 5\n" + NODE, ["3: wire.l: no key 'baud'; "]),
        ("[wire.l]\ntype = 'can'\nbitrate = 5\n" + NODE, ["3: .*10000..1000000, not 5"]),
        ("[wire.l]\ntype = 'can'\n[wire.m]\ntype = 'can'\n" + NODE, ["5: .*l and m"]),
        ("[wire.rrc]\ntype = 'serial'\n" + RRC, ["3: .*a wire of this name"]),
        (
            "[wire.l]\ntype='serial'\nframing = '9N1'\n" + RRC + "wire='l'",
            ["3: .*data bits, parity and stop bits as 8N1, not '9N1'"],
        ),
        (
            "[wire.l]\ntype='serial'\n" + RRC + "wire='l'\n[device.b]\ntype='urg'\nwire='l'",
            ["8: device.b.wire: 'rrc' is on this serial line; one of type rs485 takes several"],
        ),
        (RRC + "start.stik = 5", ["3: device.rrc.start.stik: no input 'stik'; .*'stick'?"]),
        (RRC + "start.state = 5", ["3: .*state: state is an output: it can be read, not set"]),
        (RRC + "start.stick = 5", ["3: .*it takes [stick_v_pct, stick_w_pct], not 5"]),
        (RRC + "start.stick = [1, 200]", ["3: .*stick[2]: stick_w_pct 200 is not in -100..100 %"]),
        (RRC + "start.gauge = 1.5", ["3: .*gauge takes a whole number, not 1.5"]),
        (RRC + "start.stick = [1, 2]\nstart.stick_v_pct = 3", ["4: .*stick_v_pct is given twice"]),
        (RRC + "start.gauge = {rmp = [0, 1]}", ["3: .*start.gauge: it is a number, a text, or a"]),
        (RRC + "start.gauge = {ramp=[0, 1], ovr='1s'}", ["3: .*gauge.ovr: not a key of ramp"]),
        (RRC + "start.gauge = {ramp=[1, 11], over='1s'}", ["3: .*it reaches 11, and gauge"]),
        (RRC + "[signal]\na.formula = 'b'", ["4: signal.a.formula: no signal, input or output b"]),
        (
            RRC + "[signal]\n'b\ufeff' = 1\na.formula = 'c'",
            ["4: .*a name is letters", "5: .*no signal, input or output c; known: b\\ufeff, a,"],
        ),
        (RRC + "[signal]\na = 1979-05-27", ["4: signal.a: it is a number, a text, or a table"]),
        (RRC + "[fault]\nrcr = 'cut'", ["4: fault.rcr: no device or wire 'rcr'; did you mean 'r"]),
        (RRC + "[fault]\nrrc = 5", ["4: fault.rrc: it takes a text or a list of texts, not 5"]),
        (RRC + "[fault]\nrrc = ['cut', 'ct']", ["4: fault.rrc[2]: no fault 'ct'; .*'cut'?"]),
        (RRC + "[fault]\nrrc = 'flip=2'", ["4: fault.rrc: flip takes a rate above 0"]),
        (RRC + "[fault]\nrrc = 'cut@2s-1s'", ["4: fault.rrc: fault cut ends before it begins"]),
        (
            NODE + "[fault]\ncan = 'shaft_blocked'",
            ["5: fault.can: no fault 'shaft_blocked'"],
        ),
        (RRC + "[body]\nkind = 'tank'", ["3: ", "3: ", "4: body.kind: it takes differential"]),
        (
            NODE + "[body]\nkind='differential'\nleft=5\nright='node'\nwheel_radius_m=1\ntread_m=1",
            ["7: body.right: 'node' drives left already"],
        ),
        (
            RRC + "[body]\nkind='differential'\nleft=5\nright='rrc'\nwheel_radius_m=1\ntread_m=1",
            ["5: body.left: no device '5'; known: rrc", "6: body.right: 'rrc' has no shaft"],
        ),
        (RRC + "[real]\nrcr.link = 'x'", ["4: real.rcr: no device or wire 'rcr'; did you mean"]),
        (RRC + "[real.rrc]\nserve = 'http://x'", ["4: real.rrc.serve: 'http://x' is not rfc2217"]),
        (RRC + "[real.rrc]\nchannel = 'x'", ["4: real.rrc: no key 'channel'; "]),
        (
            NODE + "[real.node]\nlink = 'x'",
            ["4: .*wire of 'node' is 'can', write [real.can]"],
        ),
        (
            RRC + "[device.b]\ntype='rrc'\n[real]\nrrc.link = 'x'\nb.link = 'x'",
            ["7: real.b: bench/x is that of 'rrc' already"],
        ),
        (
            NODE + "[real.can]\ninterface = 'socketcn'",
            ["5: .*no driver 'socketcn'; did you"],
        ),
        (
            "[wire.l]\ntype='serial'\n" + RRC + "wire='l'\n"
            "[hardware]\nl.port = 'x'\nrrc.port = 'x'",
            ["8: hardware.rrc.port: the port of wire 'l' is given twice"],
        ),
        (
            RRC + "[real.rrc]\nserve = ['rfc2217://7000', 'socket://127.0.0.1:7000']",
            ["3: real.rrc: port 7000 of 127.0.0.1 is that of 'rrc' already"],
        ),
        (
            RRC + "[device.b]\ntype='rrc'\n[real]\nrrc.serve = 'socket://0'\nb.serve = 'socket://'",
            ["7: real.b.serve: 'socket://': port '' is not in 0..65535"],
        ),
        (RRC + "[hardware.rrc]\nbaud = 9600", ["3: hardware.rrc: no key 'port'"]),
        (
            RRC + "[hardware.rrc]\nport = 'x'\npower_on = 'a \"'\npower_off = 'b'",
            ["5: hardware.rrc.power_on: 'a \"': no closing quotation"],
        ),
        (RRC + "[hardware.rrc]\nport='x'\npower_on='a'", ["3: .*power_on and power_off come tog"]),
        (RRC + "[hardware.tolerance]\nstick_pct = 51", ["4: .*it takes a number 0..50, not 51"]),
        (RRC + "seed = 1\n[seeds]", ["3: device.rrc: no key 'seed'; known", "4: no key 'seeds'"]),
        ("seed = -1\n" + RRC, ["1: seed: it takes a whole number 0.."]),
    ],
)
def test_a_mistake_is_told_in_its_line(text: str, expected: list[str]) -> None:
    found = mistakes(text)
    assert len(found) == len(expected), found
    for line, wanted in zip(found, expected, strict=True):
        first, *rest = wanted.split(".*")
        assert line.startswith(first)
        assert all(each in line for each in rest), line


def test_all_mistakes_are_told_at_once() -> None:
    spoilt = WHOLE.replace('type = "can"', 'type = "cann"').replace("baud = 57600", "baud = yes")
    spoilt = spoilt.replace('"rrc"', '"rcr"').replace("[real.vr2]", "[real.vr]")
    spoilt = spoilt.replace("@2s-3s", "@3s-2s").replace("stick_pct = 5", "stick_pct = 55")
    assert [line.partition(" ")[0] for line in mistakes(spoilt)] == [
        *("4:", "9:", "25:", "40:", "54:", "77:")
    ]


def test_what_follows_from_a_mistake_is_not_told() -> None:
    spoilt = WHOLE.replace("[device.left]", "[device.left").replace("[wire.rs]", "[wire rs]")
    assert [line.partition(":")[0] for line in mistakes(spoilt)] == ["7", "13"]


def test_a_file_that_is_no_text_is_told_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_bytes(b"seed = 1\n# \xff\n")
    with pytest.raises(RigFileError, match=r"rig\.toml:2: the byte 0xff is no UTF-8"):
        read_rig_file(file)
    with pytest.raises(FileNotFoundError):
        read_rig_file(tmp_path / "nowhere.toml")


def test_what_is_far_too_big_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "run.trace"
    path.write_bytes(b"#" * (4 << 20))
    with pytest.raises(RigFileError, match="1: no device"):
        read_rig_file(path)
    path.write_bytes(b"# tickrig-trace v2 {}\n" + b"#" * (4 << 20))
    with pytest.raises(RigFileError, match="1: it is a trace"):
        read_rig_file(path)
    path.write_bytes(b"#" * (4 << 20) + b"#")
    with pytest.raises(RigFileError, match="1: more than 4 MB: this is no rig file"):
        read_rig_file(path)


def test_a_store_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "store.json").write_text("mine")
    (tmp_path / "folder").mkdir()
    text = '[device.{name}]\ntype = "epos"\nnode_id = {at}\nstore = "{name}{suffix}"\n'
    rig = text.format(name="store", at=1, suffix=".json") + text.format(
        name="folder", at=2, suffix=""
    )
    with pytest.raises(RigFileError) as caught:
        parse_rig_file(rig, tmp_path / "rig.toml")
    first, second = (f"{line}: {reason}" for line, reason in caught.value.mistakes)
    assert first.startswith("4: device.store.store: ")
    assert "store.json: not a store file" in first
    assert second == f"8: device.folder.store: {tmp_path}/folder: not a file"


def test_what_an_eds_has_wrong_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.eds").write_text("[DeviceInfo]\nno\n[1000]\nDataType=7\nDefaultValue=x\n")
    with pytest.raises(RigFileError) as caught:
        parse_rig_file('\n[device.a]\ntype = "a.eds"\nnode_id = 1', tmp_path / "rig.toml")
    assert {line for line, _ in caught.value.mistakes} == {3}
    assert any("[1000]" in reason for _, reason in caught.value.mistakes)


def test_a_rig_takes_the_bit_rate_of_its_dcf(tmp_path: Path) -> None:
    text = (ROOT / "examples" / "io_module.eds").read_text("utf-8")
    text += "\n[DeviceComissioning]\nNodeID=0x09\nBaudrate=250\n"
    (tmp_path / "module.dcf").write_text(text)
    rig = '[device.module]\ntype = "module.dcf"\n'
    plan = parse_rig_file(rig, tmp_path / "rig.toml")
    assert plan.wires["can"].bit_rate == 250_000
    given = parse_rig_file('[wire.a]\ntype = "can"\nbitrate = 50000\n' + rig, tmp_path / "b.toml")
    assert given.wires["a"].bit_rate == 50_000
