"""Every type of device keeps what every device must keep."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from tests.device.rtc_lite.reference_model import checked
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.config import LiteConfig
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.urg.parameters import UrgParameters
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, World
from tickrig.emulators.commands.device_type import DEVICES
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.testing import check_device, strategies
from tickrig.wire.modbus.requests import Request, encode_request
from tickrig.wire.modbus.rtu import encode_frame
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

BASE = BaseParameters(friction=0.1, noise=0.05, seed=3, delay_ms=7)
POST = World(posts=(Post(2, 0, 0.5),))


def lite(framing: Framing = Framing.LITE, **settings: Any) -> Callable[[], None]:
    return partial(
        check_device,
        partial(RtcLiteNode, LiteEcho, LiteConfig(framing, **settings)),
        wire=partial(SerialLine, 57_600),
        traffic=strategies.chunks(LITE_FRAMES, 90),
        start=LITE_ACTIVE,
    )


def urg(scip: str) -> Callable[[], None]:
    return partial(
        check_device,
        partial(Urg, UrgParameters(noise=0.5, scip=scip), POST),
        traffic=strategies.chunks([f"{line}\n".encode() for line in URG_LINES]),
    )


def rh3(parameters: BaseParameters) -> Callable[[], None]:
    orders = [encode_frame(1, encode_request(order)) for order in RH3_ORDERS]
    return partial(
        check_device,
        partial(Rh3Base, parameters),
        traffic=strategies.chunks(orders),
        start=RH3_ENABLED,
    )


CHECKS: dict[str, Callable[[], None]] = {
    "RRC": partial(check_device, Rrc, traffic=strategies.chunks(RRC_LINES)),
    "RRC that is on": partial(
        check_device, Rrc, traffic=strategies.chunks(RRC_LINES), start=RRC_ON, max_examples=60
    ),
    "RTC-Lite node": lite(),
    "its timer": lite(context=LiteContextType.TIMER, rate_hz=300),
    "its slow timer": lite(context=LiteContextType.TIMER, rate_hz=7),
    "RTno": lite(Framing.RTNO),
    "RH3 base": rh3(BASE),
    "RH3 base at once": rh3(BaseParameters()),
    "URG of SCIP 1.1": urg("1.1"),
    "URG of SCIP 2.0": urg("2.0"),
}


@pytest.mark.parametrize("name", CHECKS)
def test_a_device_keeps_what_every_device_must_keep(name: str) -> None:
    CHECKS[name]()


@pytest.mark.parametrize("name", DEVICES.built_in)
def test_so_does_each_type_as_it_is_registered(name: str) -> None:
    check_device(DEVICES.load(name), max_examples=5)


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
