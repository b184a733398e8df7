"""DCF, comparison, store and restore: with our slave, LocalNode and durand."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from tests.device.canopen.reference import NODE_ID, make_dictionary
from tests.emulators.testing.conformance.stacks import (
    NOT_IN_BOTH,
    OF_LOCAL_NODE,
    PDO_SUBS,
    PDOS,
    durand,
    local_node,
    ours,
)
from tests.host.canmon.net.test_net_verbs import net
from tickrig.device import make_epos
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.testing.conformance.conformance import SlaveBench
from tickrig.emulators.testing.conformance.slave import Slave
from tickrig.host.canmon.net import session
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.wire.canopen.eds.eds_writer import write_dcf, write_eds

Net = Callable[..., Result]

CHANGED = {
    (0x1017, 0): b"\x64\0",
    (0x1A00, 0): b"\x02",
    (0x1A00, 1): bytes.fromhex("10000120"),
    (0x1A00, 2): bytes.fromhex("08000020"),
    (0x1800, 2): b"\x05",
}
"""Heartbeat; a TPDO mapped anew."""
KEPT = (0x1017, *range(0x1800, 0x1802), *range(0x1A00, 0x1A02), *range(0x2001, 0x2006))


@pytest.fixture
def on(monkeypatch: pytest.MonkeyPatch) -> Callable[[Slave], Net]:
    """Return what puts a slave of any stack on a bus, and calls `canmon net` there."""

    def put(slave: Slave) -> Net:
        source = SlaveBench(slave, 1_000_000).source
        monkeypatch.setattr(session, "open_conform_source", lambda *words: source)
        return lambda *words: net("its-bus", *words)

    return put


def dcf(path: Path, leave_out: tuple[int, ...] = ()) -> str:
    """Write a DCF of R1 that configures what differs, and what does not."""
    made = make_dictionary()
    entries = [
        entry
        for entry in made.description
        if entry.index not in leave_out
        and not (leave_out and entry.index in PDOS and entry.sub in PDO_SUBS)
    ]
    values = {entry.key: entry.power_on_data(NODE_ID) for entry in entries}
    for (index, sub), data in CHANGED.items():
        values[index << 8 | sub] = data
    text = write_dcf(Dictionary(entries, made.objects).description, NODE_ID, 1_000_000, values)
    path.write_text(only_values(text), "utf-8")
    return str(path)


def only_values(text: str) -> str:
    """Leave ParameterValues to the objects that are configured: a DCF need not have all."""
    sections = re.split(r"(?m)^(?=\[)", text)
    kept = [
        section
        if any(section.upper().startswith(f"[{index:04X}") for index in KEPT)
        else re.sub(r"(?m)^ParameterValue=.*\n", "", section)
        for section in sections
    ]
    return "".join(kept)


STACKS = [(ours, ()), (local_node, OF_LOCAL_NODE), (durand, NOT_IN_BOTH)]


@pytest.mark.parametrize(("make", "leave_out"), STACKS, ids=["ours", "LocalNode", "durand"])
def test_what_a_dcf_says_is_in_the_node_then(
    make: Callable[[], Slave],
    leave_out: tuple[int, ...],
    on: Callable[[Slave], Net],
    tmp_path: Path,
) -> None:
    call, file = on(make()), dcf(tmp_path / "r1.dcf", leave_out)
    before = call("compare", f"{NODE_ID}", file)
    assert before.exit_code == 1, before.output
    dry = call("dcf", f"{NODE_ID}", file, "--dry-run")
    assert dry.exit_code == 0
    unread = "2004h:00 u8_write_only: it cannot be read, 0 (0x00) in the file\n"
    assert dry.stdout.startswith(before.stdout + unread)
    plan = dry.stdout.removeprefix(before.stdout + unread).splitlines()
    assert all(line.startswith("not done: ") for line in plan)
    entries = [line.split()[2] for line in plan]
    empties = entries.index("1A00h:00")
    assert entries.index("1800h:01") < empties < entries.index("1A00h:01"), "disabled, emptied"
    assert entries.index("1A00h:01") < entries.index("1A00h:00", empties + 1), "and filled"
    assert call("compare", f"{NODE_ID}", file).stdout == before.stdout, "nothing is written"
    written = call("dcf", f"{NODE_ID}", file)
    assert written.exit_code == 0, written.output
    after = call("compare", f"{NODE_ID}", file)
    assert (after.exit_code, after.stdout) == (0, ""), after.output
    again = call("dcf", f"{NODE_ID}", file)
    assert again.stdout == unread, again.output


def test_the_whole_is_written_where_that_is_wanted(
    on: Callable[[Slave], Net], tmp_path: Path
) -> None:
    call, file = on(ours()), dcf(tmp_path / "r1.dcf")
    result = call("dcf", f"{NODE_ID}", file, "--all", "--skip", "1017h", "--store")
    assert result.exit_code == 0, result.output
    assert result.stderr.splitlines()[-1] == f"node {NODE_ID}: stored"
    (left,) = call("compare", f"{NODE_ID}", file).stdout.splitlines()
    assert left.startswith("1017h:00 ")


def test_what_was_stored_stays_and_what_was_restored_goes(
    on: Callable[[Slave], Net],
) -> None:
    call = on(make_epos(5))
    for words in (
        ("write", "5", "1017h=u16:100"),
        ("store", "5"),
        ("nmt", "reset-node", "5"),
    ):
        assert call(*words).exit_code == 0
    assert call("read", "5", "1017h").stdout == "1017h:00 heartbeat_time = 100 (0x0064)\n"
    result = call("restore", "5", "--reset")
    assert result.exit_code == 0, result.output
    assert "a hanging load may fall" in result.stderr
    assert call("read", "5", "1017h").stdout == "1017h:00 heartbeat_time = 0 (0x0000)\n"


RIG = """\
[device.left]
type = "epos"
node_id = 5

[device.right]
type = "epos"
node_id = 6

[device.right.options]
"""


@pytest.fixture
def rig(tmp_path: Path) -> str:
    path = tmp_path / "bench.toml"
    path.write_text(RIG.replace("[device.right.options]\n", ""))
    return str(path)


def test_two_nodes_are_alike_but_for_their_node_id(rig: str) -> None:
    result = net(rig, "compare", "5", "6")
    assert (result.exit_code, result.stdout) == (0, ""), result.output
    assert re.fullmatch(r"objects that differ: 0 of \d+\n", result.stderr)


def test_an_eds_stands_for_its_defaults(rig: str, tmp_path: Path) -> None:
    path = tmp_path / "epos.eds"
    path.write_text(write_eds(make_epos(5).dictionary.description), "utf-8")
    assert net(rig, "compare", "5", str(path)).exit_code == 0
    text = path.read_text("utf-8")
    path.write_text(re.sub(r"(?s)(\[1017\].*?DefaultValue=)\w+", r"\g<1>20", text), "utf-8")
    result = net(rig, "compare", "5", str(path))
    assert result.exit_code == 1
    assert result.stdout == (
        "1017h:00 producer_heartbeat_time: 0 (0x0000) here, 20 (0x0014) in the file\n"
    )


def drive_dcf(path: Path, **values: int) -> str:
    entries = make_epos(5).dictionary.description
    wanted = {entry.key: entry.power_on_data(5) for entry in entries}
    for name, value in values.items():
        key = int(name.removeprefix("at_"), 16)
        wanted[key] = value.to_bytes(len(wanted[key]), "little")
    path.write_text(write_dcf(entries, 5, 1_000_000, wanted), "utf-8")
    return str(path)


def test_what_may_turn_a_motor_is_told(rig: str, tmp_path: Path) -> None:
    file = drive_dcf(tmp_path / "x.dcf", at_604000=15)
    result = net(rig, "dcf", "5", file)
    assert "1 object of x.dcf to node 5. This may turn a motor: controlword" in result.stderr


def test_a_refusal_in_the_middle_says_which_pdo_is_disabled(rig: str, tmp_path: Path) -> None:
    file = drive_dcf(tmp_path / "x.dcf", at_180001=0x180, at_180002=1)
    result = net(rig, "dcf", "5", file)
    assert result.exit_code == 1
    told = result.stderr.splitlines()[-1]
    assert "1800h:01 tpdo1_communication_parameter.cob_id: refused: invalid value" in told
    assert told.endswith("the PDO of 1800h stays disabled")


def test_ctrl_c_in_the_middle_says_which_pdo_is_disabled(
    rig: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, write, calls = drive_dcf(tmp_path / "x.dcf", at_180002=1), NodeBus.write, list[int]()

    def press(bus: NodeBus, node_id: int, index: int, sub: int, data: bytes) -> None:
        calls.append(index)
        if len(calls) == 3:
            raise KeyboardInterrupt
        write(bus, node_id, index, sub, data)

    monkeypatch.setattr(NodeBus, "write", press)
    result = net(rig, "dcf", "5", file)
    assert result.exit_code == 130
    told = result.stderr.splitlines()[-1]
    assert told.startswith("interrupted; done: 1800h:01 tpdo1_communication_parameter.cob_id = 0x8")
    assert "; not done: 1800h:02 tpdo1_communication_parameter.transmission_type = 1" in told
    assert told.endswith("; the PDO of 1800h stays disabled")


def test_a_node_that_dies_in_the_middle_is_told(
    rig: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Path(rig).open("a") as opened:
        opened.write('[fault]\nleft = "power_off@300ms"\n')
    file = drive_dcf(tmp_path / "x.dcf", at_180002=1, at_101700=7)
    result = net(rig, "dcf", "5", file, "--all")
    assert result.exit_code == 1
    told = result.stderr.splitlines()[-1]
    assert "no answer within 500 ms; done: " in told
    assert "; not done: " in told


@pytest.mark.parametrize(
    ("words", "status", "why"),
    [
        (("dcf", "5", "nosuch.dcf"), 2, "FILE nosuch.dcf: No such file"),
        (("dcf", "5", "{eds}"), 2, "has no ParameterValue of an object that can be written"),
        (("dcf", "6", "{dcf}", "--skip", "1017"), 0, ""),
        (("dcf", "5", "{dcf}", "--skip", "hartbeat"), 2, "no object 'hartbeat' of node 5"),
        (
            ("dcf", "5", "{r1}"),
            2,
            "of another device: device type 000F0191h in the EDS",
        ),
        (("compare", "5", "nosuch"), 2, "FILE nosuch: No such file"),
        (("compare", "5", "128"), 2, "128 is no node-ID 1..127"),
        (("compare", "5", "7"), 1, "node 7: 1005h:00 cob_id_sync: no answer within 500 ms"),
        (("store", "5", "some"), 2, "'some' is not all, communication, application"),
        (("store", "5", "9"), 1, "1010h:09: refused: sub-index does not exist"),
        (("restore", "5", "9"), 1, "1011h:09: refused: sub-index does not exist"),
    ],
)
def test_what_cannot_be_is_one_line(
    rig: str, tmp_path: Path, words: tuple[str, ...], status: int, why: str
) -> None:
    eds = tmp_path / "x.eds"
    eds.write_text(write_eds(make_epos(5).dictionary.description), "utf-8")
    files = {"eds": eds, "dcf": drive_dcf(tmp_path / "x.dcf"), "r1": dcf(tmp_path / "r1.dcf")}
    result = net(rig, *(word.format(**files) for word in words))
    assert result.exit_code == status, result.output
    told = [line for line in result.stderr.splitlines() if line.startswith("Error:")]
    assert len(told) == bool(status)
    assert why in "".join(told)


def test_a_cob_id_of_more_than_32_bits_is_told(rig: str, tmp_path: Path) -> None:
    path = Path(drive_dcf(tmp_path / "x.dcf"))
    text = path.read_text("utf-8")
    wide = r"(?s)(\[1800sub1\].*?)DataType=0x0007(.*?)ParameterValue=\w+"
    path.write_text(re.sub(wide, r"\1DataType=0x001B\2ParameterValue=0x123456789", text), "utf-8")
    for words in (("dcf", "5", str(path)), ("boot", "5", "--eds", str(path))):
        result = net(rig, *words)
        assert result.exit_code == 2, result.output
        assert "a COB-ID of more than 32 bits, or more than 255 mapped" in result.stderr
