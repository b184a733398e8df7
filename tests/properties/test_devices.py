"""Every type of device keeps what every device must keep."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Any

import pytest
from hypothesis import given, settings

from tests.device.canopen import reference
from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO, make_dictionary
from tests.device.rtc_lite.reference_model import checked
from tests.soak import examples
from tickrig.device.canopen.device_rtc import CanopenEcho, make_device_rtc
from tickrig.device.canopen.ds401.module import Ds401
from tickrig.device.canopen.ds402.drive import Ds402
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.canopen.models.f_palette_boot import make_f_palette_boot
from tickrig.device.canopen.models.motor_core_unit import make_motor_core_unit
from tickrig.device.canopen.slave import Application, CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rrc.settings import RrcConfig
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.device.twin import Copyable
from tickrig.device.ucode_reader import Marker, UcodeReader
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, UrgParameters, World
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.commands.device_type import DEVICES
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.properties.device_bench import DeviceBench
from tickrig.emulators.testing.properties.strategies import Session
from tickrig.testing import check_device, strategies
from tickrig.wire.can import CanFrame
from tickrig.wire.modbus import Request, encode_frame, encode_request
from tickrig.wire.rrc import commands as cmd
from tickrig.wire.rtc_lite.codes import LiteContextType
from tickrig.wire.rtc_lite.frame import Framing
from tickrig.wire.rtc_lite.values import LONG

RRC_LINES = [
    *(command.encode() for command in (cmd.Limit(60, 70, 90, 40, 80), cmd.Output(30, -20))),
    *(cmd.Joystick(reverse_mode=mode).encode() for mode in range(4)),
    *(cmd.Watchdog(ticks).encode() for ticks in (0, 3, 30)),
    *(cmd.Status(on).encode() for on in (0, 1)),
    *(cmd.Beep((on, 3, 0, 2, 7, 0, 0, 0, 1, 1)).encode() for on in (0, 5)),
    *(b"stablemode1\n", b"stablemode00\n", b"device\n", b"hello\n", b"\n", b"x" * 90, b"\r\n"),
]
RRC_ON = [
    (20_000, "set", ("power_button", 1)),
    (20_000, "set", ("power_button", 0)),
    (350_000, "send", b"statusA1\n"),
]

WRITE = checked("PS", b"\x02\x04in" + LONG.encode(42))
LITE_FRAMES = [
    *(checked("CX"), checked("CI"), checked("AA"), WRITE, checked("AE"), checked("CY", b"\x01")),
    *(checked("AD"), checked("AR"), checked("AB"), checked("AC"), checked("CZ")),
    *(checked("BW", b"\x2c\x01"), checked("QG", b"\x03out"), b"\nZz\xd4", b"\nAA\x83"),
    *(WRITE[:5], WRITE[5:], b"\n", b"x" * 70),
]
LITE_ACTIVE = [(5_000, "send", checked("CI")), (5_000, "send", checked("AA"))]

WORDS = (0, 1, 6, 0x10, 0x7FFF, 0x8000, 0xFFFF)
RH3_ORDERS = [
    *(Request(6, write=(0x10, (mode,))) for mode in range(3)),
    *(Request(6, write=(0x11, (command,))) for command in range(7)),
    *(Request(6, write=(0x12, (silence_ms,))) for silence_ms in (0, 50, 500)),
    *(Request(6, write=(at, (word,))) for at in range(0x20, 0x2D) for word in WORDS[::3]),
    *(Request(16, write=(at, (0, a, 0, b))) for at in (0x100, 0x104) for a in WORDS for b in WORDS),
    *(Request(23, (0x200, 14), (0x100, (0, word, 0xFFFF, word))) for word in WORDS),
]
RH3_ENABLED = [
    (5_000, "send", encode_frame(1, encode_request(Request(6, write=(at, (1,))))))
    for at in (16, 17)
]

URG_LINES = [
    *("BM", "QT", "RS", "TM0", "TM1", "TM2", "VV", "PP", "II", "CR05", "CR99", "HS1"),
    *("GD0380038801", "GS0380038803", "MD0384038401000", "MD0384038601102", "MS0384038401003"),
    *("XX", "MD03", "SS115200"),
    *("SCIP2.0", "V", "L0", "L1", "G38038603", "S1152000000000"),
]

CAN_FRAMES = [
    *("000#0105", "000#8005", "000#8105", "000#0205", "705#R", "701#05", "080#", "205#0F00"),
    *("605#4000100000000000", "605#2B1710000A000000", "605#2140200008000000", "605#0041424344"),
    *(
        "605#2F60600003000000",
        "605#2F60600001000000",
        "605#2F60600006000000",
        "605#2F6060000A000000",
    ),
    *(
        "605#2B40600006000000",
        "605#2B40600007000000",
        "605#2B4060000F000000",
        "605#2B4060001F000000",
    ),
    *("605#23FF600090010000", "605#237A6000B80B0000", "605#2B40600080000000", "305#01020304"),
    *("605#2F0018020A000000", "605#2B0118050F000000", "605#A010100104000000", "605#C1"),
]
CAN_IDS = [0x000, 0x080, 0x100, 0x205, 0x305, 0x405, 0x505, 0x605, 0x705, 0x7E5]

BASE = BaseParameters(friction=0.1, noise=0.05, seed=3, delay_ms=7)
POST = World(posts=(Post(2, 0, 0.5),))
UCODE_MARKERS = (Marker("0" * 32, 1, 0), Marker("1" * 32, 0, 2))


def lite(framing: Framing = Framing.LITE, **settings: Any) -> dict[str, Any]:
    return {
        "device_type": partial(RtcLiteNode, LiteEcho, LiteConfig(framing, **settings)),
        "wire": partial(SerialLine, 57_600),
        "traffic": strategies.chunks(LITE_FRAMES, 90),
        "start": LITE_ACTIVE,
    }


def urg(scip: str) -> dict[str, Any]:
    lines = [f"{line}\n".encode() for line in URG_LINES]
    sensor = partial(Urg, UrgParameters(noise=0.5, scip=scip), POST)
    return {"device_type": sensor, "traffic": strategies.chunks(lines), "remembers": True}


def rh3(parameters: BaseParameters) -> dict[str, Any]:
    orders = [encode_frame(1, encode_request(order)) for order in RH3_ORDERS]
    return {
        "device_type": partial(Rh3Base, parameters),
        "traffic": strategies.chunks(orders),
        "start": RH3_ENABLED,
        "remembers": True,
        "max_examples": examples(6),
    }


class WithInputs(Copyable):
    """A slave with the physical side of its application where `check_device` looks for it."""

    def __init__(self, make: Callable[[], CanopenSlave]) -> None:
        self.slave = slave = make()
        self.application = Application.of(slave)
        self.inputs, self.outputs = self.application.inputs, tuple(self.application.outputs)
        self.reset, self.tick, self.bus_state = slave.reset, slave.tick, slave.bus_state
        self.read, self.tick_us = self.application.read, slave.tick_us

    due_us = property(lambda self: self.slave.due_us)
    accepts = property(lambda self: self.slave.accepts)
    reconfigured_by = property(lambda self: self.slave.reconfigured_by)
    on_accepts = property(lambda self: self.slave.on_accepts)


def reference_slave() -> CanopenSlave:
    return make_slave(reference.make_dictionary(()), 5)


def reference_drive() -> CanopenSlave:
    return make_slave(make_dictionary({DRIVE}), 5, application=Ds402)


def reference_io() -> CanopenSlave:
    return make_slave(make_dictionary({GENERIC_IO}), 5, application=Ds401)


def canopen(make: Callable[[], CanopenSlave]) -> dict[str, Any]:
    return {
        "device_type": partial(WithInputs, make),
        "wire": CanWire,
        "traffic": strategies.frames(CAN_FRAMES, CAN_IDS),
        "start": [(10_000, "send", (CanFrame.parse("000#0105"),))],
        "remembers": True,
        "max_examples": examples(6),
    }


REMEMBERS = ("rh3-base", "ucode-reader", "urg")
"""A base rolls on, a mirror turns on, and what a reader has not understood is counted for ever."""

KINDS: dict[str, dict[str, Any]] = {
    "RRC": {"device_type": Rrc, "traffic": strategies.chunks(RRC_LINES)},
    "RRC that is on": {
        "device_type": Rrc,
        "traffic": strategies.chunks(RRC_LINES),
        "start": RRC_ON,
        "max_examples": examples(20),
    },
    "RRC with a vehicle": {
        "device_type": partial(Rrc, RrcConfig(vehicle=True, battery_wh=1)),
        "traffic": strategies.chunks(RRC_LINES),
        "start": RRC_ON,
        "max_examples": examples(20),
    },
    "RTC-Lite node": lite(),
    "its timer": lite(context=LiteContextType.TIMER, rate_hz=300),
    "its slow timer": lite(context=LiteContextType.TIMER, rate_hz=7),
    "RTno": lite(Framing.RTNO),
    "RH3 base": rh3(BASE),
    "RH3 base at once": rh3(BaseParameters()),
    "URG of SCIP 1.1": urg("1.1"),
    "URG of SCIP 2.0": urg("2.0"),
    "ucode reader": {
        "device_type": partial(UcodeReader, None, UCODE_MARKERS),
        "wire": partial(SerialLine, 38_400),
        "traffic": strategies.chunks([b"ID\n", b"ON\n", b"OFF\r\n", b"X\n"]),
        "remembers": True,
        "max_examples": examples(10),
    },
    "CANopen slave": canopen(reference_slave),
    "CiA 401 module": canopen(reference_io),
    "CiA 402 drive": canopen(reference_drive),
    "f-palette": canopen(partial(make_f_palette, 5)),
    "f-palette-boot": canopen(partial(make_f_palette_boot, 5)),
    "motor core unit": canopen(partial(make_motor_core_unit, 5)),
    "EPOS": canopen(partial(make_epos, 5)),
    "DeviceRTC": canopen(partial(make_device_rtc, CanopenEcho, 5)),
}


@pytest.mark.hypothesis
@pytest.mark.parametrize("name", KINDS)
def test_a_device_keeps_what_every_device_must_keep(name: str) -> None:
    check_device(**{"max_examples": examples(10), **KINDS[name]})


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[ProcessPoolExecutor]:
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        yield pool


def go_on(pickled: bytes, session: Session) -> list[tuple[object, ...]]:
    """Go on in another process."""
    bench: DeviceBench = pickle.loads(pickled)
    return bench.play(session)


@pytest.mark.hypothesis
@pytest.mark.parametrize("name", KINDS)
def test_a_device_goes_on_in_another_process(name: str, elsewhere: ProcessPoolExecutor) -> None:
    kind = {"wire": SerialLine, "start": (), **KINDS[name]}
    make = kind["device_type"]
    sessions = strategies.sessions(make(), kind["traffic"])

    @settings(max_examples=examples(3))
    @given(sessions, sessions)
    def check(before: Session, after: Session) -> None:
        bench = DeviceBench(make, kind["wire"], kind["start"])
        bench.play(before)
        answer = elsewhere.submit(go_on, pickle.dumps(bench), after)
        assert answer.result() == bench.play(after)

    check()


@pytest.mark.hypothesis
@pytest.mark.parametrize("name", DEVICES.built_in)
def test_so_does_each_type_as_it_is_registered(name: str) -> None:
    check_device(name, max_examples=examples(3), remembers=name in REMEMBERS)


def test_a_reset_of_a_base_that_rolls_is_the_same_however_often_it_was_ticked() -> None:
    def rolled(dense: bool) -> list[float]:
        line, base = SerialLine(), Rh3Base()
        rig = Rig(Station(base, line.a), dense=dense)
        base.inputs.set("load_left_nm", -100)
        rig.run_for(1_503_000)
        base.reset()
        rig.run_for(50_000)
        return [base.read(name) for name in base.outputs]

    assert rolled(dense=True) == rolled(dense=False)


def test_a_noisy_sensor_sees_nothing_where_nothing_is() -> None:
    line, urg = SerialLine(), Urg(UrgParameters(noise=0.5, scip="2.0"))
    rig = Rig(Station(urg, line.a))
    line.b.send(0, b"BM\nMD0384038401001\n")
    rig.run_for(1_000_000)
    assert b"MD0384038401000\n99b" in line.b.poll(rig.now_us)
