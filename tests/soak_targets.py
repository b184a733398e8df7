"""What `tools/soak` throws inputs of chance at; each raises for what must not be."""

from __future__ import annotations

import json
import shutil
import socket
import tempfile
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import partial
from io import StringIO
from pathlib import Path
from random import Random
from typing import Final

from tests.device.rtc_lite.reference_model import checked
from tests.host.canmon.model.logs import mutations as logs
from tests.host.canopen.commissioning.net_bench import NetBench
from tests.host.canopen.data_sheet import mutations as eds
from tests.mutators import damaged, with_piece
from tests.properties import test_devices as known
from tickrig import Bench
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import UrgParameters
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.serial.network import NetworkPort, ServeUrl
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.emulators.testing.bench.modes.virtual_mode import VirtualMode
from tickrig.emulators.testing.fuzz import DeviceFuzz
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.net.lss_verb import LssSettings, LssWork
from tickrig.host.canmon.net.session import NetSession, NodeFailed
from tickrig.host.canopen.commissioning.lss_master import LssMaster
from tickrig.host.cli.messages import Refused
from tickrig.host.control.clock import ServingClock
from tickrig.host.control.server import ControlServer
from tickrig.host.rtc.commands.system_control import SystemControl
from tickrig.host.rtc.components import EXAMPLES
from tickrig.host.rtc.system.manager import Manager
from tickrig.host.rtc.system.schedule import RealTime
from tickrig.wire.can import CanFrame, Frames, data_frame
from tickrig.wire.canopen.lss import LSS_MASTER_COB_ID, LSS_SLAVE_COB_ID, LssAddress, LssCommand
from tickrig.wire.instant import NEVER
from tickrig.wire.modbus import Request, encode_frame, encode_request
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


TELNET: Final = (
    *(b"\xff\xfa\x2c", b"\xff\xf0", b"\xff\xfa", b"\xff" * 700, b"\xff\xff", b"hello\n"),
    *(b"\xff\xfb\x2c" * 300, b"\xff\xfd\x00" * 900, b"\xff\xfe", b"\xff\xfa\x18\x00\xff\xf0"),
    *(b"\xff\xfa\x2c\x01\x00\x00\x25\x80\xff\xf0", b"\xff\xfa\x2c\x01\x7f\xff\xff\xfe\xff\xf0"),
    *(b"\xff\xfa\x2c\x05\x08\xff\xf0", b"\xff\xfa\x2c" + bytes(5_000)),
)
"""What a host of RFC 2217 says, cut and garbled where it is joined with noise."""


class NetworkTarget:
    """A line served by RFC 2217, and hosts that garble telnet; one behind them is served."""

    def __init__(self) -> None:
        self._port, self._now_us = NetworkPort(ServeUrl("rfc2217")), 0
        self._port.watch_setting(115_200, lambda setting: None)

    def __del__(self) -> None:
        """Listen no more."""
        self._port.close()

    def __call__(self, chance: Random) -> str:
        """Send garbled telnet as a host, and be the next host."""
        with self._host() as host:
            for _ in range(chance.randrange(1, 12)):
                word = chance.choice([*TELNET, chance.randbytes(chance.randrange(1, 60))])
                with suppress(OSError):  # it does not take more, or has hung up
                    host.send(word[: chance.randrange(1, len(word) + 1)])
                self._poll(chance.randrange(3))
        self._poll(300)
        with self._host() as host:
            host.send(b"ping")
            assert self._poll(300) == b"ping"
            self._port.send(self._now_us, b"pong")
            assert b"pong" in host.recv(65_536)
        self._poll(300)
        return "served"

    def _host(self) -> socket.socket:
        host = socket.create_connection((self._port.address, self._port.port))
        host.setblocking(False)
        self._poll(3)
        return host

    def _poll(self, times: int) -> bytes:
        taken = b""
        for _ in range(times):
            self._now_us += 10_000
            taken += self._port.poll(self._now_us)
        return taken


class OddSlave:
    """An LSS slave with an oddity.

    Args:
        slave: the slave.
        chance: when it is odd.
        odd: what is wrong with it, of `ODD`.
    """

    tick_us = 1_000

    def __init__(self, slave: CanopenSlave, chance: Random, odd: str) -> None:
        self._slave, self._chance, self._odd = slave, chance, odd
        self._late: list[tuple[int, CanFrame]] = []

    @property
    def due_us(self) -> int:
        """When it acts next."""
        return min(self._slave.due_us, *(at_us for at_us, _ in self._late), NEVER)

    def reset(self) -> None:
        """Begin anew."""
        self._slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        """Answer oddly."""
        asked = [frame for frame in rx if frame.can_id == LSS_MASTER_COB_ID]
        if asked and self._odd == "resets" and self._chance.random() < 0.02:
            self._slave.reset()
        sent = [] if asked and self._odd == "deaf" else list(self._slave.tick(now_us, rx))
        said = [frame for frame in sent if frame.can_id == LSS_SLAVE_COB_ID]
        other = [frame for frame in sent if frame.can_id != LSS_SLAVE_COB_ID]
        answers = [each for frame in said for each in self._answers(now_us, frame)]
        if self._odd == "echo":
            answers += [data_frame(LSS_SLAVE_COB_ID, frame.data) for frame in asked]
        if self._odd == "always":
            answers += [data_frame(LSS_SLAVE_COB_ID, b"\x4f" + bytes(7)) for _ in asked]
        answers += [frame for at_us, frame in self._late if at_us <= now_us]
        self._late = [(at_us, frame) for at_us, frame in self._late if at_us > now_us]
        return (*other, *answers)

    def _answers(self, now_us: int, frame: CanFrame) -> Iterator[CanFrame]:
        """Yield what is said in place of an answer."""
        chance, data = self._chance, frame.data
        match self._odd:
            case "never":
                return
            case "twice":
                yield frame
            case "late":
                delay_us = chance.choice([3_000, 19_000, 25_000, 499_000, 501_000, 900_000])
                self._late.append((now_us + delay_us, frame))
                return
            case "selector":
                data = bytes([chance.choice([0, 0x11, 0x17, 0x44, 0x4F, 0x5E, 0xFF])]) + data[1:]
            case "noise":
                data = chance.randbytes(chance.randrange(9))
            case "refuses" if data[0] in {0x11, 0x13, 0x17}:
                data = bytes([data[0], chance.choice([1, 2, 3, 0xFF]), 9]) + bytes(5)
            case "node-ID" if data[0] == LssCommand.INQUIRE_NODE_ID:
                data = bytes([data[0], chance.choice([0, 128, 254])]) + bytes(6)
        yield data_frame(LSS_SLAVE_COB_ID, data)


ODD: Final = (
    *("none", "deaf", "resets", "echo", "always", "never", "twice", "late", "selector", "noise"),
    *("refuses", "node-ID"),
)
LSS_CALLS: Final = (
    LssSettings(),
    LssSettings(node_ids=(5, 6), store=True),
    LssSettings(LssAddress(0, 0x6210, 0x10000, 1), node_ids=(7,), bit_rate=500_000, store=True),
    LssSettings(only_node=True, node_ids=(7,)),
    LssSettings(only_node=True, bit_rate=250_000, delay_ms=100),
)


def lss(chance: Random) -> str:
    """Have odd slaves configured; all of them are told to wait at the end."""
    slaves = (make_epos(chance.choice([255, 255, 4])) for _ in range(chance.choice([1, 1, 2, 3])))
    bench = NetBench(*(OddSlave(slave, chance, chance.choice(ODD)) for slave in slaves))
    session = NetSession(ConformSource(bench.host, "a-bus", "", virtual=True), 500_000)
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        try:
            LssWork(session, LssMaster(session.bus), chance.choice(LSS_CALLS)).run(yes=True)
            outcome = "done"
        except NodeFailed:
            outcome = "failed"
        except Refused:
            outcome = "refused"
    told = [text for text in bench.frames if text.startswith("7E5")]
    assert not told or told[-1] == "7E5#0400000000000000"
    return outcome


SYSTEM_WORDS: Final = (
    *("ConsoleIn0", "ConsoleOut0", "ConsoleIn0.out", "ConsoleOut0.in", "ConsoleOut", "SeqIn"),
    *("ConfigSample0", "int_param0", "vector_param0", "default", "toml", "xml", "\0", "\x1b[2J"),
    *("1", "-1", "1e308", "nan", "1,2,3", "9" * 400, "", "ConsoleOut?x=\n", "a/b", "..", "\xe4"),
)


class SystemTarget:
    """The control socket of a system of RT components: requests with odd fields."""

    def __init__(self) -> None:
        self._manager = manager = Manager()
        for kind in EXAMPLES:
            manager.register(kind)
        self._runner = RealTime(manager, ServingClock())
        self._control = SystemControl(manager, self._runner)

    def __call__(self, chance: Random) -> str:
        """Make requests of a system, and take all of it apart again."""
        for name in ("ConsoleIn", "ConsoleOut", "ConfigSample"):
            self._manager.create(name, f"{name}0")
        done = 0
        for _ in range(20):
            verb = chance.choice([name for name in self._control._verbs if name != "stop"])
            fields = {name: self._field(chance) for name in self._control._verbs[verb][1]}
            request = json.dumps({"v": 1, "do": verb, **fields}).encode()
            answer = json.loads(self._control.answer_line(request))
            done += answer["ok"]
            assert answer["ok"] or answer["error"]
        for component in tuple(self._manager.components):
            self._manager.delete(component.instance_name)
        return f"{done} of 20 done"

    def _field(self, chance: Random) -> object:
        if chance.random() < 0.7:
            return chance.choice(SYSTEM_WORDS)
        words = [chance.choice(SYSTEM_WORDS) for _ in range(2)]
        return chance.choice(
            [words, dict([words]), None, True, 0, -1, 2**70, 1e308, 5e-324, [[]], 10]
        )


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
    "rfc2217": NetworkTarget,
    "rtc": SystemTarget,
    "lss": lambda: lss,
}
