"""What `tools/soak` throws inputs of chance at; each raises for what must not be."""

from __future__ import annotations

import json
import shutil
import socket
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random
from typing import Final

from tests.device.rtc_lite.reference_model import checked
from tests.host.canopen.data_sheet import mutations as eds
from tests.host.monitor.logs import mutations as logs
from tests.mutators import damaged, with_piece
from tests.properties import test_devices as known
from tickrig import Bench
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.config import LiteConfig
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.urg.parameters import UrgParameters
from tickrig.device.urg.sensor import Urg
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.modes.virtual_mode import VirtualMode
from tickrig.emulators.testing.fuzz.device_fuzz import DeviceFuzz
from tickrig.host.control.server import ControlServer
from tickrig.wire.modbus.requests import Request, encode_request
from tickrig.wire.modbus.rtu import encode_frame
from tickrig.wire.rrc import commands as cmd

Throw = Callable[[Random], str]
"""Makes an input with chance and throws it; says in a word what came of it."""

MOST_BYTES: Final = 48
UPLOAD: Final = "605#4000100000000000"
RESET: Final = "000#8205"


def _at_device(fuzz: DeviceFuzz, chance: Random) -> str:
    fuzz(chance.randbytes(chance.randrange(1, MOST_BYTES)))
    return "answered"


def _at_reader(parts: object, chance: Random) -> str:
    name, data = parts.mutated(chance)  # type: ignore[attr-defined] # a module
    return str(parts.judge(name, data))  # type: ignore[attr-defined] # a module


def rrc() -> DeviceFuzz:
    """Return the RRC."""
    device = cmd.DeviceName()
    ask = [b"\n" + device.encode() + device.encode(check=True)]
    return DeviceFuzz("rrc", known.RRC_LINES, request=ask, answer=b"RRC\n")


def rtc_lite() -> DeviceFuzz:
    """Return an RTC-Lite node."""
    return DeviceFuzz(
        partial(RtcLiteNode, LiteEcho, LiteConfig()),
        known.LITE_FRAMES,
        start=[checked("CI"), checked("AA")],
        request=[checked("CX")],
        answer=b"\nCX",
        wire=partial(SerialLine, 57_600),
    )


def rh3() -> DeviceFuzz:
    """Return the base of Reference Hardware 3."""
    words = [encode_frame(1, encode_request(order)) for order in known.RH3_ORDERS]
    start = [encode_frame(1, encode_request(Request(6, write=(at, (1,))))) for at in (16, 17)]
    ask = [encode_frame(1, encode_request(Request(3, (0x200, 14))))]
    return DeviceFuzz(
        partial(Rh3Base, known.BASE), words, start=start, request=ask, answer=b"\x01\x03\x1c"
    )


def urg() -> DeviceFuzz:
    """Return a range finder of SCIP 2.0."""
    words = [f"{line}\n".encode() for line in known.URG_LINES]
    make = partial(Urg, UrgParameters(noise=0.5, scip="2.0"), known.POST)
    return DeviceFuzz(make, words, request=[b"\nVV\n", b"\nTM2\n"], answer=b"VV\n00P\n")


def canopen() -> DeviceFuzz:
    """Return a slave with every object of the communication profile."""
    return _node(known.reference_slave)


def epos() -> DeviceFuzz:
    """Return a drive."""
    return _node(partial(make_epos, 5))


def _node(make: Callable[[], object]) -> DeviceFuzz:
    return DeviceFuzz(
        make, known.CAN_FRAMES, start=["000#0105"], request=[UPLOAD, RESET], answer="585#43001000"
    )


REQUESTS: Final = (
    '{"v": 1, "do": "set", "name": "stick", "value": [50, -20]}',
    '{"v": 1, "do": "press", "name": "power_button", "duration_us": 100000}',
    '{"v": 1, "do": "fault", "spec": "flip=0.001@2s-3s", "id": 7}',
    '{"v": 1, "do": "clear", "name": "flip"}',
    '{"v": 1, "do": "get", "names": ["state", "stick_v_pct"]}',
    *(
        '{"v": 1, "do": "status"}',
        '{"v": 1, "do": "describe"}',
        '{"v": 1, "do": "log", "since": 3}',
    ),
)
PIECES: Final = (
    *('"', "{", "}", "[", "]", "[[[[", ",", ":", "null", "true", "-1", "1e999", "NaN", "\\ud800"),
    *("state", "id", "press", "release", "wait", "1" * 40, "\u00e9", "\0", '"stick"'),
)


class ControlTarget:
    """An emulator's control socket, and a client that writes lines with chance in them."""

    def __init__(self) -> None:
        self._folder = folder = tempfile.mkdtemp(prefix="tickrig-soak-")
        self._bench = Bench("rrc")
        mode = self._bench._mode
        assert isinstance(mode, VirtualMode)
        self._server = ControlServer(Path(folder, "ctl"), EmulatorControl(mode._rig))
        self._client = socket.socket(socket.AF_UNIX)
        self._client.connect(str(Path(folder, "ctl")))
        self._server.serve(0)
        self._snapshot = self._bench.snapshot()

    def __del__(self) -> None:
        """Close the socket, and remove it."""
        self._client.close()
        self._server.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def __call__(self, chance: Random) -> str:
        """Write a line, and read its answer."""
        self._snapshot.restore()
        line = chance.choice(REQUESTS)
        for _ in range(chance.randrange(3)):
            line = with_piece(PIECES, line, chance)
        data = damaged(line.encode("utf-8", "surrogatepass"), chance, chance.randrange(8))
        data = data.replace(b"\n", b" ") + b"\n"
        for at in range(0, len(data), size := chance.choice([7, 4_000])):
            self._client.sendall(data[at : at + size])
            self._server.serve(0)
        self._bench.run_for(chance.choice([0, 10_000, 200_000]))
        return "done" if self._answer()["ok"] else "refused"

    def _answer(self) -> dict[str, object]:
        received = b""
        for _ in range(200):
            self._server.serve(0)
            try:
                received += self._client.recv(65_536, socket.MSG_DONTWAIT)
            except BlockingIOError:
                continue
            if received.endswith(b"\n"):
                answer: dict[str, object] = json.loads(received)  # one line, else it raises
                return answer
        raise AssertionError(f"no whole answer: {received!r}")


DEVICES: Final[dict[str, Callable[[], DeviceFuzz]]] = {
    "rrc": rrc,
    "rtc-lite": rtc_lite,
    "canopen": canopen,
    "epos": epos,
    "rh3": rh3,
    "urg": urg,
}


def _device(make: Callable[[], DeviceFuzz]) -> Throw:
    return partial(_at_device, make())


TARGETS: Final[dict[str, Callable[[], Throw]]] = {
    **{name: partial(_device, make) for name, make in DEVICES.items()},
    "eds": lambda: partial(_at_reader, eds),
    "logs": lambda: partial(_at_reader, logs),
    "control": ControlTarget,
}
