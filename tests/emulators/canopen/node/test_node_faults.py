"""Faults of one node, noticed by the canopen library as those of a real node are."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import can
import canopen
import pytest
from click.testing import CliRunner, Result

from tickrig import Bench, open_bench
from tickrig.emulators.can.faults import CAN_FAULTS, NARROWED
from tickrig.emulators.canopen import choices
from tickrig.emulators.canopen.faults import NODE_FAULTS, NodeFaults
from tickrig.emulators.commands import cli, ctl_cli
from tickrig.emulators.rig.faults import bind_arguments
from tickrig.emulators.rig.rig import Rig
from tickrig.wire.can import CanFrame

LONG_NAME = "a drive whose name needs segments"
ROOT = Path(__file__).parents[4]


def bench_of(folder: Path, mode: str = "virtual") -> Bench:
    """Return a bench with two drives, the name of one in segments."""
    eds = (ROOT / "examples/eds/epos.eds").read_text("utf-8")
    file = folder / "drive.eds"
    if not file.is_file():  # another process may be reading it
        name = f"DefaultValue={LONG_NAME}\n"
        file.write_text(eds.replace("DefaultValue=EPOS\n", name), "utf-8")
    return Bench(axis2=f"2={file}", axis3="3=epos", seed=3, mode=mode)


def no_objects() -> canopen.ObjectDictionary:
    return canopen.ObjectDictionary()  # type: ignore[no-untyped-call]


class Master:
    """The canopen library on the bench's bus, with what it has noticed."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.network = bench.canopen_network()
        self.node = self.network.add_node(2, no_objects())
        self.node.sdo.RESPONSE_TIMEOUT = 0.5
        self.heard: list[tuple[int, str]] = []
        for can_id in (0x182, 0x702, 0x582, 0x082):
            self.network.subscribe(can_id, self._hear)

    def _hear(self, can_id: int, data: bytearray, timestamp: float) -> None:
        self.heard.append((self.bench.now_us, f"{can_id:03X}#{data.hex().upper()}"))

    def read(self, index: int = 0x6081) -> bytes:
        return bytes(self.node.sdo.upload(index, 0))

    def read_block(self) -> bytes:
        with self.node.sdo.open(0x1008, 0, "rb", block_transfer=True) as stream:
            return bytes(stream.read())

    def write(self, index: int = 0x6081) -> None:
        self.node.sdo.download(index, 0, bytes(4))

    def frames(self, can_id: int, duration: str = "1s") -> list[str]:
        """Return what comes on a CAN-ID in a time."""
        self.heard.clear()
        self.bench.run_for(duration)
        return [text[4:] for _, text in self.heard if text.startswith(f"{can_id:03X}")]

    def sync_pdos(self, count: int = 3) -> list[str]:
        """Return the data of TPDO 1, which is synchronous, after so many SYNCs."""
        self.node.sdo.download(0x1800, 1, (0x8000_0182).to_bytes(4, "little"))
        self.node.sdo.download(0x1800, 2, b"\x01")
        self.node.sdo.download(0x1800, 1, (0x182).to_bytes(4, "little"))
        self.node.nmt.state = "OPERATIONAL"
        self.bench.run_for("5ms")
        self.heard.clear()
        for number in range(count):
            self.bench.set("axis2/0x6064", 100 * number)
            self.network.sync.transmit()
            self.bench.run_for("10ms")
        return [text[4:] for _, text in self.heard if text.startswith("182")]


@pytest.fixture
def master(tmp_path: Path) -> Iterator[Master]:
    logging.disable(logging.CRITICAL)
    with bench_of(tmp_path) as bench:
        bench.run_for("50ms")
        yield Master(bench)
    logging.disable(logging.NOTSET)


def fault(master: Master, spec: str) -> None:
    master.bench["axis2"].fault(spec)
    master.bench.run_for("2ms")


@pytest.mark.parametrize(
    ("spec", "code"),
    [
        ("sdo_abort", 0x0800_0000),
        ("sdo_abort=6081h:0x06090030", 0x0609_0030),
        ("sdo_abort=6081h:0:06060000h,write", 0x0606_0000),
        ("sdo_abort=0x06040043", 0x0604_0043),
        ("sdo_abort=any:0x06010000", 0x0601_0000),
        ("sdo_busy", 0x060A_0023),
        ("sdo_busy=0x08000022", 0x0800_0022),
    ],
)
def test_a_server_aborts(master: Master, spec: str, code: int) -> None:
    fault(master, spec)
    with pytest.raises(canopen.SdoAbortedError) as caught:
        master.write()
    assert caught.value.code == code
    if "write" in spec:
        assert master.read() == (1000).to_bytes(4, "little")
    if "6081h" in spec:
        assert master.read(0x1008) == LONG_NAME.encode()
    master.bench["axis2"].clear(spec.partition("=")[0])
    master.write()
    assert master.read() == bytes(4)


@pytest.mark.parametrize("spec", ["sdo_mute", "bus_off", "drop", "babble"])
def test_a_server_does_not_answer(master: Master, spec: str) -> None:
    fault(master, spec)
    with pytest.raises(canopen.SdoCommunicationError, match="No SDO response"):
        master.read()
    other = master.network.add_node(3, no_objects())
    if spec != "babble":  # the bus itself is well
        assert other.sdo.upload(0x6081, 0) == (1000).to_bytes(4, "little")
    master.bench["axis2"].clear(spec)
    master.bench.run_for("100ms")
    assert master.read() == (1000).to_bytes(4, "little")


def test_a_late_answer_is_taken_for_that_to_the_next_request(master: Master) -> None:
    fault(master, "sdo_slow")
    with pytest.raises(canopen.SdoCommunicationError, match="No SDO response"):
        master.read()
    with pytest.raises(canopen.SdoCommunicationError, match="returned a value for 0x6081"):
        master.read(0x1008)
    fault(master, "sdo_slow=300ms")
    master.bench.run_for("1s")
    begun_us = master.bench.now_us
    master.read()
    assert 300_000 < master.bench.now_us - begun_us < 305_000


@pytest.mark.parametrize("cleared", [False, True])
@pytest.mark.parametrize("spec", ["sdo_slow=600ms", "sdo_slow=600ms,count=1"])
def test_no_answer_overtakes_a_late_one(master: Master, spec: str, *, cleared: bool) -> None:
    fault(master, spec)
    for index in (0x6081, 0x1000, 0x1018):
        request = bytes([0x40, *index.to_bytes(2, "little"), 0, 0, 0, 0, 0])
        master.network.send_message(0x602, request)
        if cleared and index == 0x1000:
            master.bench["axis2"].clear("sdo_slow")
        else:
            master.bench.run_for("200ms")
    answers = (
        master.frames(0x582, "2s")
        if not cleared
        else [text[4:] for _, text in master.heard if text.startswith("582")]
    )
    assert [answer[2:6] for answer in answers] == ["8160", "0010", "1810"]


def test_an_answer_that_comes_twice_is_taken_for_the_next_one(master: Master) -> None:
    fault(master, "sdo_twice")
    assert master.read() == (1000).to_bytes(4, "little")
    assert master.frames(0x582, "5ms") == ["43816000E8030000"]


def test_an_answer_names_another_object(master: Master) -> None:
    fault(master, "sdo_wrong_index")
    with pytest.raises(canopen.SdoCommunicationError, match="returned a value for 0x6082"):
        master.read()


def test_a_segment_has_the_wrong_toggle_bit(master: Master) -> None:
    fault(master, "sdo_toggle")
    with pytest.raises(canopen.SdoCommunicationError, match=r"[Tt]oggle"):
        master.read(0x1008)
    assert master.read() == (1000).to_bytes(4, "little")  # nothing has a toggle bit there


def test_a_block_has_the_wrong_crc(master: Master) -> None:
    assert master.read_block() == LONG_NAME.encode()
    fault(master, "sdo_crc")
    with pytest.raises(canopen.SdoCommunicationError, match="CRC"):
        master.read_block()
    assert master.read(0x1008) == LONG_NAME.encode()


@pytest.mark.parametrize("spec", ["heartbeat_mute", "heartbeat_late", "heartbeat_late=200ms"])
def test_heartbeats_are_missing(master: Master, spec: str) -> None:
    master.node.sdo.download(0x1017, 0, (100).to_bytes(2, "little"))
    master.node.nmt.wait_for_heartbeat(0.2)
    fault(master, spec)
    with pytest.raises(canopen.nmt.NmtError, match="No boot-up or heartbeat"):
        master.node.nmt.wait_for_heartbeat(0.15)
    heard = master.frames(0x702, "2s")
    assert (heard == []) is (spec == "heartbeat_mute")


def test_a_heartbeat_tells_another_state(master: Master) -> None:
    master.node.sdo.download(0x1017, 0, (100).to_bytes(2, "little"))
    fault(master, "heartbeat_state=stopped")
    master.node.nmt.wait_for_heartbeat(0.2)
    assert master.node.nmt.state == "STOPPED"
    fault(master, "heartbeat_state=initialising")
    assert master.frames(0x702, "300ms") == ["00"] * 3  # a boot-up, to who believes it


def test_a_node_boots_late_and_hears_nothing_before(master: Master) -> None:
    fault(master, "boot_late=2s")
    master.node.nmt.state = "RESET"
    with pytest.raises(canopen.nmt.NmtError, match="boot-up"):
        master.node.nmt.wait_for_bootup(1)
    with pytest.raises(canopen.SdoCommunicationError, match="No SDO response"):
        master.read()
    master.node.nmt.wait_for_bootup(1)
    assert master.read() == (1000).to_bytes(4, "little")


def test_a_node_boots_twice(master: Master) -> None:
    fault(master, "boots_twice")
    master.node.nmt.state = "RESET"
    assert master.frames(0x702, "100ms") == ["00", "00"]


def test_a_node_restarts_by_itself(master: Master) -> None:
    master.write()
    fault(master, "boots_again=1s,count=2")
    assert master.frames(0x702, "5s") == ["00"]
    assert master.read() == (1000).to_bytes(4, "little")  # the object has its default again
    assert master.bench.describe().faults["axis2/boots_again"].rated


@pytest.mark.parametrize(
    ("spec", "data"),
    [
        ("pdo_short", ["4000000000"] * 3),
        ("pdo_short=3,1", ["400000"] * 3),
        ("pdo_long=2", ["4000000000000000"] * 3),
        ("pdo_long=tpdo=2", ["400000000000", "400064000000", "4000C8000000"]),
        ("pdo_mute", []),
        ("pdo_stale", ["400000000000"] * 3),
        ("pdo_mute=any,count=2", ["4000C8000000"]),
        ("sync_lost", []),
    ],
)
def test_pdos(master: Master, spec: str, data: list[str]) -> None:
    fault(master, spec)
    heard = master.sync_pdos()
    assert [len(text) for text in heard] == [len(text) for text in data]
    if "stale" in spec:
        assert len(set(heard)) == 1


def test_an_emcy_comes_over_and_over(master: Master) -> None:
    fault(master, "emcy_storm=8110h,10ms")
    master.bench.run_for("100ms")
    assert [error.code for error in master.node.emcy.log] == [0x8110] * 11
    fault(master, "emcy_storm=0x2310,20ms,count=3")
    master.node.emcy.log.clear()
    master.bench.run_for("1s")
    assert [error.code for error in master.node.emcy.log][-2:] == [0x2310] * 2


def test_two_nodes_have_one_node_id(master: Master) -> None:
    fault(master, "id_doubled")
    assert [text for _, text in master.heard] == ["702#00"]
    master.node.sdo.download(0x1017, 0, (100).to_bytes(2, "little"))
    assert master.frames(0x702, "210ms") == ["7F"] * 4


def test_a_node_is_bus_off_until_the_fault_ends(master: Master) -> None:
    fault(master, "bus_off")
    assert master.bench.get("axis2/can_state") == "bus-off"
    master.bench.run_for("1s")
    assert master.bench.get("axis2/can_state") == "bus-off"
    master.bench["axis2"].clear("bus_off")
    master.bench.run_for("100ms")
    assert master.bench.get("axis2/can_state") == "error-active"
    assert [error.code for error in master.node.emcy.log] == [0x8140, 0]


@pytest.mark.parametrize("spec", ["corrupt", "duplicate", "delay"])
def test_a_fault_of_the_bus_hits_one_node_alone(master: Master, spec: str) -> None:
    fault(master, spec + "=count=1")
    begun = len(master.bench.transcript())
    begun_us = master.bench.now_us
    assert master.read() == (1000).to_bytes(4, "little")
    master.bench.run_for("20ms")
    text = master.bench.transcript()[begun:]
    late = master.bench.now_us - begun_us > 30_000
    assert (text.count(" 582#") == 2, "2000008" in text, late) == {
        "corrupt": (False, True, False),
        "duplicate": (True, False, False),
        "delay": (False, False, True),
    }[spec]
    other = master.network.add_node(3, no_objects())
    fault(master, spec)
    assert other.sdo.upload(0x6081, 0) == (1000).to_bytes(4, "little")


def test_what_nobody_takes_and_what_a_fault_changes_is_marked(master: Master) -> None:
    fault(master, "drop=count=1")
    with pytest.raises(canopen.SdoCommunicationError):
        master.read()
    fault(master, "sdo_mute")
    fault(master, "heartbeat_state")
    with pytest.raises(canopen.SdoCommunicationError):
        master.read()
    marked = [line.split(" ~ ") for line in master.bench.transcript().splitlines() if " ~ " in line]
    assert {(place.split()[1], text) for place, text in marked} >= {
        ("can", "no node takes 582#43816000E8030000"),
        ("axis2", "the node hears nothing where the bus sent 602#4081600000000000"),
    }


def test_a_lone_node_needs_no_name() -> None:
    with Bench("2=epos") as bench:
        bench.fault("sdo_mute@1s")
        bench.fault("epos/drop=0.5")
        bench.clear("sdo_mute")
        assert "sdo_mute" in bench.describe().faults
        with pytest.raises(ValueError, match="did you mean 'sdo_mute'"):
            bench.fault("sdo_muted")


@pytest.mark.parametrize(
    ("spec", "error"),
    [
        ("sdo_abort=6081h:x", "'6081h:x' is not INDEX"),
        ("sdo_abort=6081h:0:1:2", "is not INDEX"),
        ("sdo_abort=6081h:100h", "is not INDEX"),
        ("sdo_abort=0x100000000", "more than 32 bits"),
        ("sdo_abort=6081h,up", "access 'up' is not both or read or write$"),
        ("sdo_abort=6081h,0x08000022", "an abort code follows a colon: 6040h:0x08000022"),
        ("sdo_busy=5", "'5' is not an abort code, 10000h to FFFFFFFFh"),
        ("sdo_slow=1us", "delay 1us is not in 1 ms to 3600 s"),
        ("pdo_short=9", "bytes 9 is not in 1 to 8 bytes"),
        ("pdo_mute=513", "tpdo '513' is not any or a number 1 to 512"),
        ("emcy_storm=x", "'x' is not an emergency error code"),
        ("heartbeat_state=up", "state 'up' is not stopped or"),
        ("bus_off=1", "bus_off takes no argument"),
        ("sdo_slwo", "did you mean 'axis2/sdo_slow'|did you mean 'sdo_slow'"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(master: Master, spec: str, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        master.bench["axis2"].fault(spec)


def test_each_default_is_a_fault() -> None:
    for name, form in NodeFaults.fault_types.items():
        bind_arguments(name, form, ())


def test_the_command_line_completes_the_names_of_all() -> None:
    of_frames = [name for name in NODE_FAULTS if name not in CAN_FAULTS]
    assert ["power_off", "unplugged", *of_frames] == list(choices.NODE_FAULTS)


def test_what_is_armed_since_when_and_how_often_it_acted_can_be_asked(master: Master) -> None:
    begun_us = master.bench.now_us
    master.bench["axis2"].fault("sdo_slow=20ms,count=2")
    master.bench["axis2"].fault("pdo_mute@1s")
    for _ in range(3):
        master.read()
    answer = master.bench._mode.request("faults")
    assert isinstance(answer["faults"], list)
    rows = {row["name"]: row for row in answer["faults"]}
    slow, mute = rows["axis2/sdo_slow"], rows["axis2/pdo_mute"]
    assert slow["arguments"] == {"delay": "20ms", "rate": "1", "count": "2"}
    assert (slow["on"], slow["acted"]) == (True, 2)
    assert 0 <= slow["since_us"] - begun_us <= 1_000
    assert (mute["on"], mute["since_us"], mute["acted"]) == (False, None, 0)
    assert rows["axis2/power_off"]["acted"] is None
    shown = ctl_cli._faults(answer)
    assert shown[0].split() == ["fault", "on", "since", "acted", "arguments"]
    line = next(each for each in shown if each.startswith("axis2/sdo_slow "))
    assert line.split()[1:] == ["on", "0.051000", "s", "2", "delay=20ms", "rate=1", "count=2"]


RIG = """
[device.axis1]
type = "epos"
node_id = 1

[device.axis2]
type = "epos"
node_id = 2

[fault]
axis1 = ["emcy_storm=5441h,10ms@100ms-150ms", "sdo_abort=6081h:0x06090030,write"]
axis2 = "boot_late=300ms"

[real]
control = "bench.ctl"

[real.can]
interface = "virtual"
channel = "node faults"
"""


def run(*words: str) -> Result:
    return CliRunner().invoke(cli.main, words)


def test_a_rig_file_orders_faults_of_its_nodes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(RIG, "utf-8")
    assert "2 devices, 1 wire, 3 faults" in run("check", "rig.toml").output
    done = run("run", "rig.toml", "--virtual", "--for", "500ms", "-vv")
    assert done.exit_code == 0, done.output
    assert done.output.count("081#4154010000000000") == 5
    (booted,) = [line for line in done.output.splitlines() if "can < 702#00" in line]
    assert "0.30" in booted
    Path("rig.toml").write_text(RIG.replace("300ms", "300"), "utf-8")
    said = run("check", "rig.toml").output
    assert "fault.axis2: boot_late: delay: '300' has no unit: write 300s, 300ms or 300us" in said


@pytest.mark.realtime
def test_the_command_ctl_orders_and_lists_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(RIG, "utf-8")
    with open_bench("rig.toml", mode="real"):
        for word, said in (
            ("axis2/sdo_slow", ""),
            ("axis2/sdo_slow=20ms,count=2", ""),
            ("sdo_slow", "no fault 'sdo_slow'; did you mean 'axis1/sdo_slow'?"),
            ("axis2/sdo_slwo", "no fault 'axis2/sdo_slwo'; did you mean 'axis2/sdo_slow'?"),
            ("axis2/sdo_slow=5", "sdo_slow: delay: '5' has no unit: write 5s, 5ms or 5us"),
            ("axis2/sdo_slow=1s,2s", "'2s' is one argument too many: sdo_slow[=DELAY]"),
            ("axis2/bus_off=1", "bus_off takes no argument, got 1"),
        ):
            done = run("ctl", "bench.ctl", "fault", word)
            assert (done.exit_code, done.output.removeprefix("Error: ").strip()) == (
                2 if said else 0,
                said,
            )
        rows = {
            line.split()[0]: line for line in run("ctl", "bench.ctl", "faults").output.splitlines()
        }
        assert rows["axis2/sdo_slow"].endswith("delay=20ms rate=1 count=2")
        assert " on " in rows["axis1/sdo_abort"]
        assert {f"axis{number}/{name}" for number in (1, 2) for name in NODE_FAULTS} <= rows.keys()
        assert run("ctl", "bench.ctl", "clear", "axis2/sdo_slow").exit_code == 0
        listed = json.loads(run("ctl", "bench.ctl", "faults", "--json").output)["faults"]
        (slow,) = [row for row in listed if row["name"] == "axis2/sdo_slow"]
        assert (slow["on"], slow["arguments"]["delay"]) == (False, "800ms")


# The same in each run.

ALL = (*NARROWED, *NODE_FAULTS)


def trip(bench: Bench, name: str) -> str:
    """Do something of all with a fault, and return what happened."""
    rated = NodeFaults.fault_types[name].rated
    bench["axis2"].fault(f"{name}=rate=0.7@60ms-700ms" if rated else f"{name}@60ms-700ms")
    link = bench.link
    requests = (
        *("000#0100", "602#2B17100032000000", "602#4008100000000000", "602#6000000000000000"),
        *("080#", "602#A40810007F000000", "602#A300000000000000", "602#A2057F0000000000"),
        *("602#A100000000000000", "602#4081600000000000", "000#8102", "602#2F60600001000000"),
    )
    for number in range(60):
        link.send((CanFrame.parse(requests[number % len(requests)]),))
        bench.run_for(f"{7 + number % 9}ms")
    bench.run_for("1s")
    return bench.transcript()


@pytest.mark.parametrize("name", ALL)
def test_forks_snapshots_and_dense_runs_do_the_same(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with bench_of(tmp_path) as bench:
        snapshot = bench.snapshot()
        first = trip(bench, name)
        snapshot.restore()
        assert trip(bench, name) == first
    with bench_of(tmp_path) as bench, bench.fork() as twin:
        assert trip(twin, name) == first
    made = Rig.__init__
    monkeypatch.setattr(
        Rig, "__init__", lambda self, *stations, **how: made(self, *stations, dense=True, **how)
    )
    with bench_of(tmp_path) as bench:
        assert trip(bench, name) == first


def test_a_fork_in_the_middle_of_a_fault_goes_on_alike(tmp_path: Path) -> None:
    with bench_of(tmp_path) as bench:
        bench["axis2"].fault("sdo_slow=50ms")
        bench["axis2"].fault("emcy_storm")
        bench.run_for("65ms")
        snapshot = bench.snapshot()
        with bench.fork() as twin:
            ends = [trip(one, "id_doubled").partition("0.060000")[2] for one in (bench, twin)]
            assert ends[0] == ends[1]
            snapshot.restore()
            assert trip(bench, "id_doubled").partition("0.060000")[2] == ends[0]


def all_trips(tmp_path: Path, *, dense: bool = False) -> str:
    """Return a hash of what happens with each fault."""
    texts, made = [], Rig.__init__
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Rig, "__init__", lambda self, *of, **how: made(self, *of, dense=dense, **how))
        for name in ALL:
            with bench_of(tmp_path) as bench:
                texts.append(trip(bench, name))
    return sha256("\n".join(texts).encode()).hexdigest()


@pytest.mark.unmeasured
def test_hash_seeds_make_no_difference(tmp_path: Path) -> None:
    bench_of(tmp_path).close()  # its files are there

    def hash_of(seed: int) -> str:
        call = f"tests.all_trips(pathlib.Path('.'), dense={bool(seed % 2)})"
        return subprocess.run(
            [sys.executable, "-c", f"import pathlib, {__name__} as tests; print({call})"],
            env={**os.environ, "PYTHONHASHSEED": str(seed), "PYTHONPATH": str(ROOT)},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        ).stdout

    with ThreadPoolExecutor(2) as pool:
        hashes = set(pool.map(hash_of, range(10)))
    assert hashes == {f"{all_trips(tmp_path)}\n"}


SHORT = {
    "sdo_slow": "20ms",
    "heartbeat_late": "50ms",
    "boot_late": "100ms",
}
"""Arguments with which a fault that takes long is over sooner."""


@pytest.mark.realtime
@pytest.mark.parametrize("name", ALL)
def test_each_fault_of_a_node_acts_in_real_time(name: str, tmp_path: Path) -> None:
    logging.disable(logging.CRITICAL)
    with bench_of(tmp_path, "real") as bench:
        bench.run_for("50ms")
        master = Master(bench)
        master.node.sdo.RESPONSE_TIMEOUT = 2
        master.node.sdo.download(0x1017, 0, (50).to_bytes(2, "little"))
        master.sync_pdos(1)
        master.node.sdo.RESPONSE_TIMEOUT = 0.1
        bench["axis2"].fault(f"{name}={SHORT[name]}" if name in SHORT else name)
        for use in (master.read, lambda: master.read(0x1008), master.read_block, master.write):
            with suppress(canopen.SdoAbortedError, canopen.SdoCommunicationError):
                use()
        master.network.sync.transmit()
        bench.run_for("100ms")
        master.node.nmt.state = "RESET"

        def acted() -> bool:
            rows = bench._mode.request("faults")["faults"]
            assert isinstance(rows, list)
            (row,) = [row for row in rows if row["name"] == f"axis2/{name}"]
            return bool(row["acted"])

        assert bench.wait_until(acted, "5s")
    logging.disable(logging.NOTSET)


@pytest.mark.realtime
def test_faults_of_a_node_in_real_time(tmp_path: Path) -> None:
    logging.disable(logging.CRITICAL)
    with Bench(axis2="2=epos", mode="real") as bench:
        bench.run_for("50ms")
        master = Master(bench)
        master.write()
        bench.fault("sdo_abort=6081h:0x06090030,count=1")
        with pytest.raises(canopen.SdoAbortedError, match=r"0x06090030|Value range"):
            master.write()
        master.write()
        bench.fault("sdo_mute", for_="2s")
        with pytest.raises(canopen.SdoCommunicationError, match="No SDO response"):
            master.read()
        bench.clear("sdo_mute")
        bench.fault("boots_again=count=1")
        assert bench.wait_until(lambda: "702#00" in [text for _, text in master.heard], "5s")
        bench.fault("emcy_storm=count=1")
        assert bench.wait_until(
            lambda: [one.code for one in master.node.emcy.log] == [0x8110], "5s"
        )
        bench.fault("bus_off")
        assert bench.wait_until(lambda: bench.get("can_state") == "bus-off", "5s")
        bench.clear("bus_off")
        assert bench.wait_until(lambda: bench.get("can_state") == "error-active", "5s")
    logging.disable(logging.NOTSET)


@pytest.mark.parametrize("fault_name", ["sdo_abort", "sdo_mute", "sync_lost"])
def test_no_fault_acts_on_what_a_node_receives_before_the_boot_up(fault_name: str) -> None:
    with Bench("epos") as bench, bench.can_bus() as bus:
        bench["epos"].fault(fault_name)
        bus.send(
            can.Message(
                arbitration_id=0x601,
                data=bytes([0x40, 0, 0x10, 0, 0, 0, 0, 0]),
                is_extended_id=False,
            )
        )
        bus.send(can.Message(arbitration_id=0x080, is_extended_id=False))
        heard = [bus.recv(0.1) for _ in range(3)]
        answer = bench._mode.request("faults")
    ids = {message.arbitration_id for message in heard if message is not None}
    assert isinstance(answer["faults"], list)
    acted = {row["name"]: row["acted"] for row in answer["faults"]}
    assert (ids, acted[fault_name]) == ({0x701}, 0)


@pytest.mark.parametrize("fault_name", ["emcy_storm", "babble"])
def test_an_emcy_before_the_boot_up_has_the_node_id(fault_name: str) -> None:
    with Bench("epos") as bench, bench.can_bus() as bus:
        bench["epos"].fault(fault_name)
        heard = [bus.recv(0.1) for _ in range(5)]
    ids = {message.arbitration_id for message in heard if message is not None}
    assert 0x081 in ids
    assert 0x080 not in ids
