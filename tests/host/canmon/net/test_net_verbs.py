"""The verbs of `canmon net` on rigs in virtual time: what they do, and what they say."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.environment import ROOT
from tickrig.device import make_epos, make_f_palette
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.testing.conformance.conformance import SlaveBench
from tickrig.host.canmon.cli import main
from tickrig.host.canmon.conform.conform_source import ConformSource
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_writer import write_log
from tickrig.host.canmon.net import node_objects, session
from tickrig.host.canmon.net.group import VERBS
from tickrig.host.canmon.net.node_objects import NamedObjects
from tickrig.host.canmon.workspace import MonitorSetup, Workspace
from tickrig.host.canopen.bus_file.bus_file import read_bus_file
from tickrig.host.cli.start import load
from tickrig.wire.can import CanFrame, ErrorFrame
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.sdo_frame import ClientCommand

CANMON = "from tickrig.commands import canmon; canmon()"
RIG = """\
[device.drive]
type = "epos"
node_id = 5

[device.module]
type = "f-palette"
node_id = 16
"""


def net(*words: str) -> Result:
    return CliRunner().invoke(main, ["net", *words], catch_exceptions=False)


def written(frames: Sequence[CanFrame]) -> list[CanFrame]:
    """Return the frames that are no SDO upload: NMT, guarding, downloads."""
    uploads = (ClientCommand.UPLOAD, ClientCommand.UPLOAD_SEGMENT)
    return [
        frame
        for frame in frames
        if frame.remote
        or frame.can_id not in range(0x601, 0x680)
        or frame.data[0] & 0xE0 not in uploads
    ]


def test_a_scan_lists_nodes_with_profile_identity_and_name(rig: str) -> None:
    result = net(rig, "scan")
    assert result.exit_code == 0
    assert [line.split() for line in result.stdout.splitlines()] == [
        ["5", "CiA", "402", "drive", "00000000:00006210:00010000:00000001", "EPOS"],
        ["16", "CiA", "401", "I/O", "00000000:00000001:00010000:00000001", "f-palette"],
    ]
    said = [json.loads(line) for line in net(rig, "scan", "--json").stdout.splitlines()]
    assert [node["node"] for node in said] == [5, 16]


def _eds_folder(tmp_path: Path, name: str = "EPOS") -> Path:
    """Return a folder with the EDS of the drive alone."""
    folder = tmp_path / "eds"
    folder.mkdir(exist_ok=True)
    text = (ROOT / "examples" / "eds" / "epos.eds").read_text("utf-8")
    assert "\nProductName=EPOS\n" in text
    text = text.replace("\nProductName=EPOS\n", f"\nProductName={name}\n")
    (folder / "drive.eds").write_text(text, "utf-8")
    return folder


def test_a_scan_is_written_as_a_bus_file_that_boots(
    rig: str, tmp_path: Path, sent: list[CanFrame]
) -> None:
    bus, folder = tmp_path / "bus.yml", _eds_folder(tmp_path)
    result = net(rig, "scan", "--write", str(bus), "--eds-dir", str(folder))
    assert result.exit_code == 0, result.output
    assert result.stdout == net(rig, "scan").stdout
    assert not [frame for frame in written(sent) if frame.can_id != 0x7E5], "LSS: who has no ID"
    assert bus.read_text("utf-8").splitlines()[1:] == [
        "master:",
        "  node_id: 1",
        "nodes:",
        "  epos_5:",
        "    node_id: 5",
        '    dcf: "eds/drive.eds"',
        "    revision_number: 0x00010000",
        "    serial_number: 0 # not checked; it has 0x00000001",
        '  # node 16, without an EDS: 00000000:00000001:00010000:00000001 "f-palette"',
    ]
    assert "node 16: not written: no EDS in " in result.stderr
    read = read_bus_file(bus)
    assert (list(read.slaves), read.findings) == (["epos_5"], ())
    assert net(rig, "boot", "5", "--bus", str(bus)).exit_code == 0


@pytest.mark.parametrize(
    "name", ["1_0", "yes", "a: {b} # c", "\u00e4\u0085-", "'\"", "x" * 200, ""]
)
def test_a_bus_file_takes_any_name_of_an_eds(rig: str, tmp_path: Path, name: str) -> None:
    bus, folder = tmp_path / "bus.yml", _eds_folder(tmp_path, name)
    result = net(rig, "scan", "--write", str(bus), "--eds-dir", str(folder))
    assert result.exit_code == 0, result.output
    assert [slave.node_id for slave in read_bus_file(bus).slaves.values()] == [5]


def test_a_bus_file_that_is_there_stays_unless_forced(rig: str, tmp_path: Path) -> None:
    bus, folder = tmp_path / "bus.yml", _eds_folder(tmp_path)
    bus.write_text("mine")
    words = ("scan", "--write", str(bus), "--eds-dir", str(folder))
    result = net(rig, *words)
    assert (result.exit_code, result.stdout, bus.read_text()) == (2, "", "mine")
    assert "bus.yml is there already: choose another name, or give --force" in result.stderr
    (folder / "drive.eds").rename(folder / "drive.txt")
    result = net(rig, *words, "--force")
    assert (result.exit_code, bus.read_text()) == (2, "mine"), "no EDS: nothing to write"
    assert result.stderr.splitlines()[-1].endswith(": nothing written")
    (folder / "drive.txt").rename(folder / "drive.eds")
    assert net(rig, *words, "--force").exit_code == 0
    assert "epos_5:" in bus.read_text()
    assert {path.name for path in tmp_path.iterdir()} == {"bus.yml", "eds", "bench.toml"}


def test_a_scan_is_written_as_a_workspace(rig: str, tmp_path: Path) -> None:
    path, folder = tmp_path / "screen.toml", _eds_folder(tmp_path)
    result = net(rig, "scan", "--workspace", str(path), "--eds-dir", str(folder))
    assert result.exit_code == 0, result.output
    assert "node 16: no EDS in " in result.stderr
    assert "the workspace has no source" in result.stderr
    setup = MonitorSetup.read(Workspace.read(path))
    assert setup.source == ()
    assert [(node, file.resolve()) for node, file in setup.eds.items()] == [
        (5, (folder / "drive.eds").resolve())
    ]
    assert [one.resolve() for one in setup.eds_dir] == [folder.resolve()]


POLLED = ("1018h:01", "1018h:02", "1018h:03")


class TwoNodes:
    """A drive and a module on a bus whose frames are kept."""

    def __init__(self) -> None:
        wire, self.records = CanWire(1_000_000), list[Record]()
        wire.observers.append(self._take)
        drive, module = make_epos(5), make_f_palette(16)
        self.rig = Rig(Station(drive, wire.end()), Station(module, wire.end()))
        self.source = ConformSource(CanHost(self.rig, wire.end()), "can0", "a bus", virtual=True)
        self.rig.run_for(1_000_000)

    def _take(self, at_us: int, frame: CanFrame | ErrorFrame) -> None:
        self.records.append(Record(at_us, "can7", frame))

    def log(self, path: Path) -> str:
        """Let a master read what the nodes are, for three seconds; write all frames as a log."""
        self.records.clear()
        for node in ("5", "16"):
            assert net("can0", "read", node, *POLLED).exit_code == 0
        self.rig.run_for(3_000_000)
        return _log(path, self.records)


def _log(path: Path, records: Sequence[Record]) -> str:
    with closing(write_log(path)) as log:
        for record in records:
            log.write(record)
    return str(path)


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> TwoNodes:
    """A bus of two nodes in virtual time, as can0."""
    bench = TwoNodes()
    monkeypatch.setattr(session, "open_conform_source", lambda *words: bench.source)
    for node, time_ms in (("5", "100"), ("16", "250")):
        assert net("can0", "write", node, f"1017h=u16:{time_ms}").exit_code == 0
    return bench


def _found(*words: object) -> tuple[int, set[tuple[str, int | None]]]:
    """Return the exit status of a check, and the rules and nodes of its findings."""
    result = CliRunner().invoke(main, ["check", *map(str, words), "--jsonl"])
    findings = [json.loads(line) for line in result.stdout.splitlines()]
    return result.exit_code, {(one["rule"], one["node"]) for one in findings}


def test_a_scan_is_written_as_rules_that_the_next_log_keeps(two: TwoNodes, tmp_path: Path) -> None:
    rules, screen = tmp_path / "rules.toml", tmp_path / "screen.toml"
    result = net("can0", "scan", "--rules", str(rules), "--workspace", str(screen))
    assert result.exit_code == 0, result.output
    assert result.stderr.splitlines()[-2:] == [
        f"{rules}: 2 nodes written",
        f"{screen}: 0 EDS files written",
    ]
    assert MonitorSetup.read(Workspace.read(screen)).source == ("can0",)
    assert rules.read_text("utf-8").splitlines()[3:] == [
        "[learnt.can0]",
        "others = true # CAN-IDs that are not listed may come",
        "",
        "[learnt.can0.node.5]",
        "vendor = 0x00000000",
        "product = 0x00006210",
        "revision = 0x00010000",
        "# serial = 0x00000001",
        "",
        "[learnt.can0.frame.705] # heartbeat of node 5",
        "lengths = [1]",
        'kind = "cyclic"',
        'period = "100ms±20%"',
        "required = true",
        "",
        "[learnt.can0.node.16]",
        "vendor = 0x00000000",
        "product = 0x00000001",
        "revision = 0x00010000",
        "# serial = 0x00000001",
        "",
        "[learnt.can0.frame.710] # heartbeat of node 16",
        "lengths = [1]",
        'kind = "cyclic"',
        'period = "250ms±20%"',
        "required = true",
    ]
    good = two.log(tmp_path / "good.log")
    assert _found(good, rules) == (0, set())
    records = two.records
    of_module = {0x710, 0x590, 0x610}
    gone = _log(tmp_path / "gone.log", [one for one in records if _id(one) not in of_module])
    assert _found(gone, rules) == (1, {("learnt-nodes", 16), ("learnt-frames", 16)})
    other = [
        one._replace(frame=CanFrame(_id(one), data.replace(b"\x10\x62", b"\x11\x62")))
        for one in records
        if isinstance(one.frame, CanFrame)
        for data in (one.frame.data,)
    ]
    found = _found(_log(tmp_path / "other.log", other), rules)
    assert found == (1, {("learnt-identity", 5)})
    new = [*records, records[-1]._replace(frame=CanFrame(0x707, b"\5"))]
    assert ("learnt-nodes", 7) in _found(_log(tmp_path / "new.log", new), rules)[1]
    assert net("can0", "write", "5", "1017h=u16:150").exit_code == 0
    found = _found(two.log(tmp_path / "slow.log"), rules)
    assert found == (1, {("learnt-period", 5)})


def _id(record: Record) -> int:
    assert isinstance(record.frame, CanFrame)
    return record.frame.can_id


def test_files_of_a_scan_are_not_overwritten(rig: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("mine")
    for option in ("--workspace", "--rules"):
        result = net(rig, "scan", option, str(path))
        assert (result.exit_code, result.stdout) == (2, "")
        assert f"{option} {path} is there already: choose another name" in result.stderr
        assert net(rig, "scan", option, str(path), "--force").exit_code == 0
        assert "mine" not in path.read_text("utf-8")


@pytest.mark.parametrize("there", ["nosuch/bus.yml", "eds"])
def test_a_bus_file_that_cannot_be_written_is_one_line(
    rig: str, tmp_path: Path, there: str
) -> None:
    bus, folder = tmp_path / there, _eds_folder(tmp_path)
    result = net(rig, "scan", "--write", str(bus), "--eds-dir", str(folder), "--force")
    assert result.exit_code == 2, result.output
    why = f"{bus}: Is a directory" if bus == folder else f"{bus.parent}: No such file or directory"
    assert result.stderr.splitlines()[-1] == f"Error: --write {why}"
    assert result.stdout == "", "before the bus is opened"


def test_objects_are_read_by_name_and_by_index(rig: str) -> None:
    result = net(rig, "read", "5", "statusword", "1018h:2", "manufacturer_device_name", "0x6060")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines() == [
        "6041h:00 statusword = 0x0350 switch on disabled",
        "1018h:02 identity_object.product_code = 0x00006210",
        "1008h:00 manufacturer_device_name = 'EPOS'",
        "6060h:00 modes_of_operation = 1 (0x01)",
    ]


def test_names_of_the_standard_mean_the_same_object(rig: str) -> None:
    assert net(rig, "read", "5", "device_name").stdout.startswith("1008h:00 manufacturer_dev")


@pytest.mark.parametrize("name", ["identity_object.product_code", "identity.product"])
def test_names_hold_with_an_eds_and_without_one(
    rig: str, name: str, request: pytest.FixtureRequest
) -> None:
    told = net(rig, "read", "5", name).stdout
    assert told == "1018h:02 identity_object.product_code = 0x00006210\n"
    request.getfixturevalue("drive")
    told = net("a-bus", "read", "5", name).stdout
    assert told == "1018h:02 identity.product = 0x00006210\n"


def test_the_eds_need_not_call_objects_as_the_standards_do(
    drive: SlaveBench, tmp_path: Path
) -> None:
    text = write_eds(make_epos(5).dictionary.description)
    for name in ("Statusword", "Product code", "Producer heartbeat time"):
        assert f"ParameterName={name}" in text
        text = text.replace(f"ParameterName={name}", "ParameterName=Ours")
    path = tmp_path / "drive.eds"
    path.write_text(text, "utf-8")
    names = ("statusword", "identity_object.product_code", "identity.product", "heartbeat_time")
    result = net("a-bus", "read", "5", *names, "producer_heartbeat_time", "--eds", str(path))
    assert [line.split()[0] for line in result.stdout.splitlines()] == [
        *("6041h:00", "1018h:02", "1018h:02", "1017h:00", "1017h:00")
    ], result.output


def test_all_that_the_eds_names_is_read(rig: str) -> None:
    result = net(rig, "read", "5", "--json")
    assert result.exit_code == 1, "1003h:01 has no data"
    said = {(one["index"], one["sub"]): one for one in map(json.loads, result.stdout.splitlines())}
    assert said[0x1000, 0]["value"] == 0x20192
    assert "1003h:01 pre_defined_error_field.error_1: refused: no data" in result.stderr


def test_objects_are_written_and_what_may_turn_a_motor_is_told(rig: str) -> None:
    result = net(rig, "write", "5", "controlword=6", "heartbeat_time=0x64")
    assert result.exit_code == 0, result.output
    assert result.stderr.splitlines() == [
        "writes to node 5: 6040h:00 controlword = 6, 1017h:00 producer_heartbeat_time = 0x64."
        " This may turn a motor: controlword",
        "written: 6040h:00 controlword = 6",
        "written: 1017h:00 producer_heartbeat_time = 0x64",
    ]


def test_what_a_node_refuses_ends_it_and_says_what_was_done(rig: str) -> None:
    result = net(rig, "write", "5", "1017h=5", "1008h=text:x", "1017h=7")
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1] == (
        "Error: node 5: 1008h:00 manufacturer_device_name: refused: object is read only"
        " (06010002h); done: 1017h:00 producer_heartbeat_time = 5; not done:"
        " 1008h:00 manufacturer_device_name = text:x, 1017h:00 producer_heartbeat_time = 7"
    )


def test_nmt_commands_and_what_comes_of_them(rig: str) -> None:
    result = net(rig, "nmt", "reset-node", "5")
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (0, "node 5: boot-up")
    result = net(rig, "nmt", "start", "5")
    assert "This may turn a motor" in result.stderr
    assert result.stderr.endswith("node 5: sent; it has no heartbeat that tells its state\n")
    result = net(rig, "nmt", "reset-comm", "ALL")
    assert result.stderr.splitlines()[1:] == ["node 5: boot-up", "node 16: boot-up"]


_READS = {"scan", "read", "compare"}


def test_each_verb_that_writes_has_a_dry_run() -> None:
    assert {
        name
        for name, (path, _) in VERBS.items()
        if not any("--dry-run" in option.opts for option in load(path).params)
    } == _READS


@pytest.mark.parametrize(
    ("words", "steps"),
    [
        ("nmt start 5", ["NMT start to node 5 (000#0105)"]),
        ("nmt reset-node all", ["NMT reset-node to all nodes (000#8100)"]),
        (
            "write 5 controlword=6 heartbeat_time=0x64",
            ["6040h:00 controlword = 6", "1017h:00 producer_heartbeat_time = 0x64"],
        ),
        ("store 5 all", ["1010h:01 = 'save'"]),
        ("restore 5 --reset", ["1011h:01 = 'load'", "NMT reset-node to node 5"]),
    ],
)
def test_a_dry_run_prints_the_steps_in_order_and_writes_nothing(
    rig: str, sent: list[CanFrame], words: str, steps: list[str]
) -> None:
    result = net(rig, *words.split(), "--dry-run")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines() == [f"not done: {step}" for step in steps]
    assert result.stderr.splitlines()[-1] == "dry run: nothing was written"
    assert not written(sent)
    assert net(rig, *words.split()).exit_code == 0
    assert written(sent)


def test_a_dry_run_refuses_what_cannot_be_written(rig: str, sent: list[CanFrame]) -> None:
    result = net(rig, "write", "5", "heartbeat_time=5", "controlword=x", "--dry-run")
    assert result.exit_code == 2
    assert "'x' is no number; controlword is UNSIGNED16" in result.stderr
    result = net(rig, "restore", "5", "communication", "--dry-run")
    assert result.exit_code == 1
    assert "1011h:02: refused: sub-index does not exist" in result.stderr
    assert not written(sent)


@pytest.fixture
def drive(monkeypatch: pytest.MonkeyPatch) -> SlaveBench:
    """Node 5 of a bus of which nobody knows who is on it."""
    bench = SlaveBench(make_epos(5), 1_000_000)
    source = replace(bench.source, virtual=False)
    monkeypatch.setattr(session, "open_conform_source", lambda *words: source)
    return bench


@pytest.mark.parametrize("word", ["start", "stop", "pre-op"])
def test_a_command_to_a_node_that_is_not_there_has_not_ended_well(
    drive: SlaveBench, word: str
) -> None:
    result = net("a-bus", "nmt", word, "9", "--yes")
    assert result.exit_code == 1
    assert result.stderr.splitlines()[-1] == (
        "Error: node 9: sent, but nothing answers as node 9: it is not there, or Stopped without"
        f" a heartbeat; done: NMT {word} to node 9"
    )


def test_a_stopped_node_is_started(drive: SlaveBench) -> None:
    assert net("a-bus", "nmt", "stop", "5", "--yes").exit_code == 0
    result = net("a-bus", "nmt", "start", "5", "--yes")
    assert result.exit_code == 0, "it answers once it is started"
    assert result.stderr.endswith("node 5: sent; it has no heartbeat that tells its state\n")


def test_a_stopped_node_with_a_heartbeat_is_known(drive: SlaveBench) -> None:
    assert net("a-bus", "write", "5", "heartbeat_time=100", "--yes").exit_code == 0
    for _ in range(2):
        result = net("a-bus", "nmt", "stop", "5", "--yes")
        assert (result.exit_code, result.stderr.splitlines()[-1]) == (0, "node 5: Stopped")


def test_of_nodes_without_a_heartbeat_nothing_is_known(drive: SlaveBench) -> None:
    assert net("a-bus", "read", "5", "1000h").exit_code == 0
    told = net("a-bus", "nmt", "start", "all", "--yes").stderr
    assert "no node has reported its state since" in told
    assert net("a-bus", "write", "5", "heartbeat_time=100", "--yes").exit_code == 0
    assert net("a-bus", "nmt", "start", "all", "--yes").stderr.splitlines()[-2:] == [
        "node 5: Operational",
        "sent; other nodes, if there are any, have no heartbeat that tells their state",
    ]


def test_an_eds_of_another_device_is_told(rig: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_text(write_eds(make_epos(5).dictionary.description), "utf-8")
    result = net(rig, "read", "16", "1000h", "--eds", str(path))
    assert "warning: node 16: this EDS is of another device: device type" in result.stderr


@pytest.mark.parametrize(
    ("words", "status", "why"),
    [
        (("read", "5", "stausword"), 2, "no object 'stausword' of node 5; did you mean 'status"),
        (("read", "7", "1000h"), 2, "has no node 7; its nodes: 5, 16"),
        (("read", "five", "1000h"), 2, "'five' is no node-ID 1..127."),
        (("write", "5", "1A00h:0=0"), 1, "; disable the PDO first: 1800h:01 with bit 31"),
        (("read", "128", "1000h"), 2, "128 is not in the range 1<=x<=127"),
        (("read", "5", "1000h", "--eds", "nosuch.eds"), 2, "--eds nosuch.eds: No such file"),
        (("write", "5", "controlword"), 2, "'controlword' is not OBJECT=VALUE"),
        (("write", "5", "controlword=-1"), 2, "-1 is not in the range of UNSIGNED16 (0 to 65535)"),
        (("write", "5", "controlword=x"), 2, "'x' is no number; controlword is UNSIGNED16"),
        (("write", "5", "2222h=1"), 2, "the type of 2222h:00 is not known: give its EDS"),
        (("write", "5", "2222h=u16:1"), 1, "2222h:00: refused: object does not exist"),
        (("write", "5", "1018h:9=u8:1"), 1, "refused: sub-index does not exist"),
        (("nmt", "start", "0"), 2, "'0' is no node-ID 1..127, and not all"),
        (("nmt", "sart", "5"), 2, "'sart' is not one of 'start'"),
        (("red", "5"), 2, "No such command 'red'"),
        (("scan", "--write", "b.yml"), 2, "--write: a bus.yml needs the EDS of each node: give"),
        (("scan", "--write", "b.yml", "--eds-dir", "nosuch"), 2, "--eds-dir nosuch: No such file"),
        (("scan", "--eds-dir", "."), 2, "--eds-dir is for --write FILE, or --workspace FILE"),
        (("scan", "--rules", "r", "--eds-dir", "."), 2, "--eds-dir is for --write FILE, or"),
        (("scan", "--force"), 2, "--force is for --write FILE, --workspace FILE or --rules FILE"),
        (("scan", "--rules", "no/r"), 2, "--rules no: No such file"),
        (
            ("scan", "--rules", "r", "--workspace", "./r"),
            2,
            "the same file for several options: choose another",
        ),
        (("scan", "--wait", "x"), 2, "--wait 'x' is not a time"),
        (("scan", "--wait", "5"), 2, "--wait '5' has no unit: write 5s, 5ms or 5us"),
    ],
)
def test_what_cannot_be_is_one_line(
    rig: str, words: tuple[str, ...], status: int, why: str
) -> None:
    result = net(rig, *words)
    assert result.exit_code == status, result.output
    (told,) = (line for line in result.stderr.splitlines() if line.startswith("Error:"))
    assert why in told


def test_what_answers_nothing_is_no_source() -> None:
    assert "no SOURCE: name a bus as can0" in net("scan").stderr
    assert "is no bus: a log holds what was said" in net("run.log", "scan").stderr


def test_another_file_is_no_source(tmp_path: Path) -> None:
    path = tmp_path / "drive.dcf"
    path.touch()
    told = f"SOURCE {str(path)!r} is neither a bus as can0 nor a rig file as bench.toml"
    assert told in net(str(path), "scan").stderr


def test_where_nobody_is_there_the_question_ends_with_a_full_stop(drive: SlaveBench) -> None:
    result = net("a-bus", "write", "5", "target_position=1")
    assert result.exit_code == 2
    assert "target position. There is no terminal to ask: give --yes" in result.stderr


def test_a_bus_that_cannot_be_made_is_one_line() -> None:
    done = subprocess.run(
        [sys.executable, "-c", CANMON, "net", "udp:no.such.group", "scan"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr.count("\n")) == (3, 1), done.stderr


def test_a_bus_may_stand_in_options() -> None:
    result = net("-i", "nosuch", "-c", "x", "scan")
    assert result.exit_code == 2
    assert "-i 'nosuch' is not an interface of python-can" in result.stderr


@pytest.mark.parametrize(
    ("entry", "data", "said"),
    [
        ((0x1019, 0), "09000000", "9 (0x00000009)"),
        ((0x1019, 0), "09", "9 (0x09)"),
        ((0x1017, 0), "E8030000", "1000 (0x000003E8)"),
        ((0x1019, 0), "090000AA", "0xAA000009 (0xAA000009)"),
    ],
)
def test_a_value_that_is_longer_than_its_type_is_read(
    entry: tuple[int, int], data: str, said: str
) -> None:
    assert node_objects.shown(NamedObjects(5), entry, bytes.fromhex(data)) == said
