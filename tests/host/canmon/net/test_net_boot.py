"""`canmon net boot` on rigs in virtual time: the boot-up of CiA 302-2, step by step."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.environment import ROOT
from tests.host.canmon.net.test_net_configuration import drive_dcf
from tests.host.canmon.net.test_net_verbs import net, written
from tickrig.device import make_epos
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.eds.eds_writer import write_eds

RIG = """\
[device.drive]
type = "epos"
node_id = 5
"""
BUS = ROOT / "examples" / "bus" / "bus.yml"


def steps(text: str) -> list[str]:
    """Return the steps without their times, which do not go back."""
    found = [re.fullmatch(r"(\d+\.\d{6}) (.*)", line) for line in text.splitlines()]
    assert all(found)
    times = [match[1] for match in found if match]
    assert times == sorted(times)
    return [match[2] for match in found if match]


def test_each_step_is_told(rig: str, tmp_path: Path) -> None:
    file = drive_dcf(tmp_path / "x.dcf", at_101700=100)
    path = Path(file)
    text = re.sub(
        r"(?s)\[(?!1017\])(\w+)\](.*?)(?=\n\[|$)", _without_value, path.read_text("utf-8")
    )
    path.write_text(text, "utf-8")
    result = net(rig, "boot", "5", "--eds", file, "--steps", "--start")
    assert result.exit_code == 0, result.output
    assert steps(result.stdout) == [
        "1000h:00 device type: 00020192h; as expected",
        "1018h:02 product code: 00006210h; as expected",
        "1017h:00 := 0064h: taken; goes on",
        "heartbeat: Pre-operational; goes on",
    ]
    assert result.stderr.splitlines() == [
        "node 5: booted",
        "NMT start to node 5. This may turn a motor: a drive that is Operational obeys RPDOs",
        "node 5: started",
    ]


def _without_value(match: re.Match[str]) -> str:
    return re.sub(r"\nParameterValue=[^\n]*", "", match[0])


def test_nothing_but_an_answer_is_expected_unless_told(rig: str) -> None:
    result = net(rig, "boot", "5", "--steps")
    assert result.exit_code == 0, result.output
    assert steps(result.stdout) == ["1000h:00 device type: 00020192h; not checked"]
    assert "nothing is expected of the node but that it answers" in result.stderr
    assert net(rig, "boot", "5").stdout == ""


def test_what_a_bus_yml_expects_is_done(rig: str) -> None:
    path = Path(rig)
    path.write_text(RIG.replace("node_id = 5", "node_id = 2"))
    result = net(rig, "boot", "2", "--bus", str(BUS), "--steps")
    assert result.exit_code == 0, result.output
    told = steps(result.stdout)
    assert told[0] == "1000h:00 device type: 00020192h; as expected"
    assert "6098h:00 := 23h: taken; goes on" in told
    assert told[-1] == "heartbeat: Pre-operational; goes on"
    assert "This may turn a motor: homing method" in result.stderr


@pytest.mark.parametrize("words", [(), ("--start",)])
@pytest.mark.parametrize("option", ["--explain", "--dry-run"])
def test_what_is_explained_is_only_read(
    rig: str, sent: list[CanFrame], option: str, words: tuple[str, ...]
) -> None:
    Path(rig).write_text(RIG.replace("node_id = 5", "node_id = 2"))
    call = ("boot", "2", "--bus", str(BUS), *words)
    booted = net(rig, *call, "--steps")
    assert written(sent)
    sent.clear()
    result = net(rig, *call, option)
    assert result.exit_code == 0, result.output
    assert sent
    assert not written(sent)
    wanted = [step.split(": ")[0] for step in steps(booted.stdout) if " := " in step]
    told = steps(result.stdout)
    assert [step.split(": ")[0] for step in told if " := " in step] == wanted, "in this order"
    assert "1017h:00 := 0064h: 0000h now; would be written" in told
    assert result.stderr == "node 2: nothing was written\n"
    assert ("NMT start: not sent; would be sent" in told) is ("--start" in words)


def test_who_is_kept_alive_is_not_guarded_to_explain(rig: str, sent: list[CanFrame]) -> None:
    assert net(rig, "boot", "5", "--keep-alive").exit_code == 0
    assert {frame.can_id for frame in written(sent)} == {0x705, 0x000}
    sent.clear()
    result = net(rig, "boot", "5", "--keep-alive", "--explain")
    assert (result.exit_code, written(sent)) == (0, [])
    assert steps(result.stdout)[1:] == [
        "state by guarding: not sent; not known",
        "reset communication: not sent; would be sent unless it is Operational",
    ]


def test_an_update_and_a_restore_are_explained(
    rig: str, tmp_path: Path, sent: list[CanFrame]
) -> None:
    bus = tmp_path / "bus.yml"
    node = "{node_id: 5, dcf: r1.eds, restore_configuration: 2, guard_time: 100}"
    bus.write_text(f"master: {{node_id: 1}}\nnodes:\n  drive: {node}\n")
    eds = tmp_path / "r1.eds"
    eds.write_text(write_eds(make_epos(5).dictionary.description), "utf-8")
    result = net(rig, "boot", "5", "--bus", str(bus), "--explain")
    assert result.exit_code == 0, result.output
    assert not written(sent)
    told = steps(result.stdout)
    assert "1011h:02 := load: not sent; would be written" in told
    assert "reset communication: not sent; would be sent" in told


@pytest.mark.parametrize("with_file", [True, False])
def test_an_update_of_software_is_explained(
    tmp_path: Path, sent: list[CanFrame], with_file: bool
) -> None:
    rig, bus = tmp_path / "boot.toml", tmp_path / "bus.yml"
    rig.write_text('[device.module]\ntype = "f-palette-boot"\nnode_id = 17\n')
    (tmp_path / "new.bin").write_bytes(bytes(100))
    file = "software_file: new.bin, " if with_file else ""
    eds = ROOT / "examples" / "eds" / "f-palette-boot.eds"
    node = f"{{node_id: 17, dcf: {eds}, {file}software_version: 0x1234}}"
    bus.write_text(f"master: {{node_id: 1}}\nnodes:\n  module: {node}\n")
    result = net(str(rig), "boot", "17", "--bus", str(bus), "--explain")
    assert not written(sent)
    if not with_file:
        assert result.exit_code == 1
        assert "error status H: other software than expected" in result.stderr
        return
    assert result.exit_code == 0, result.output
    assert steps(result.stdout)[-5:] == [
        "1F56h:01 software identification: F18AE307h; not 00001234h: to be updated",
        "1F51h:01 := stop: not sent; would be written unless it is stopped",
        "1F51h:01 := clear: not sent; would be written",
        "1F50h:01 := 100 bytes: not sent; would be written",
        "1F51h:01 := start: not sent; would be written, then booted from the beginning",
    ]


def test_a_slave_that_the_master_does_not_boot_is_explained(
    rig: str, tmp_path: Path, sent: list[CanFrame]
) -> None:
    bus, eds = tmp_path / "bus.yml", ROOT / "examples" / "eds" / "epos.eds"
    node = f"{{node_id: 5, dcf: {eds}, boot: false, heartbeat_producer: 100}}"
    bus.write_text(f"master: {{node_id: 1}}\nnodes:\n  drive: {node}\n")
    result = net(rig, "boot", "5", "--bus", str(bus), "--explain")
    assert (result.exit_code, written(sent)) == (0, []), result.output
    assert steps(result.stdout) == [
        "1F81h: bit 2 is 0; not booted by this master",
        "heartbeat: not waited for; must come within 300 ms",
    ]


def test_who_is_kept_alive_by_a_heartbeat_is_listened_to(
    rig: str, tmp_path: Path, sent: list[CanFrame]
) -> None:
    file = drive_dcf(tmp_path / "x.dcf", at_101700=100)
    result = net(rig, "boot", "5", "--eds", file, "--keep-alive", "--explain")
    assert (result.exit_code, written(sent)) == (1, []), "no heartbeat yet"
    assert "error status E: to be kept alive, but no heartbeat came" in result.stderr


def test_an_explained_boot_of_another_device_fails(rig: str, sent: list[CanFrame]) -> None:
    other = ROOT / "tests" / "golden" / "canopen" / "r1.eds"
    result = net(rig, "boot", "5", "--eds", str(other), "--explain")
    assert result.exit_code == 1
    assert "Error: node 5: error status C: 1000h device" in result.stderr
    assert not written(sent)


def test_another_device_ends_with_its_letter(rig: str) -> None:
    other = ROOT / "tests" / "golden" / "canopen" / "r1.eds"
    result = net(rig, "boot", "5", "--eds", str(other), "--steps")
    assert result.exit_code == 1
    assert steps(result.stdout)[-1].endswith("1000h device type is another than expected")
    assert result.stderr.splitlines()[-1].startswith("Error: node 5: error status C: 1000h device")


def test_who_is_kept_alive_is_looked_at_and_not_reset(rig: str) -> None:
    result = net(rig, "boot", "5", "--steps", "--keep-alive")
    assert result.exit_code == 0, result.output
    assert steps(result.stdout)[1:] == [
        "state by guarding: Pre-operational; goes on",
        "boot-up after reset communication: boot-up; goes on",
    ]


def test_a_silent_node_has_status_b(tmp_path: Path) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(RIG + '[fault]\ndrive = "power_off@50ms"\n')
    result = net(str(path), "boot", "5", "--steps")
    assert result.exit_code == 1
    assert steps(result.stdout)[0] == "1000h:00 device type: no answer; asked again"
    assert "error status B: 1000h device type cannot be read" in result.stderr


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--bus", "nosuch.yml"), "--bus nosuch.yml: No such file"),
        (("--eds", "nosuch.eds"), "--eds nosuch.eds: No such file"),
        (("--bus", "a.yml", "--eds", "a.eds"), "--bus or --eds: which? give one"),
        (("--bus", str(BUS)), "has no slave 5; its slaves: "),
    ],
)
def test_what_cannot_be_is_one_line(rig: str, words: tuple[str, ...], why: str) -> None:
    result = net(rig, "boot", "5", *words)
    assert result.exit_code == 2, result.output
    (told,) = (line for line in result.stderr.splitlines() if line.startswith("Error:"))
    assert why in told
