from __future__ import annotations

from pathlib import Path

from tests.host.canopen.conform.r1 import R1
from tests.host.canopen.conform.under_test import Judged
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.stack import make_slave
from tickrig.host.canopen.conform.check import ConformancePlan, Level
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import RO, EntryDescription

R1_EDS = Path(__file__).parents[3] / "golden/canopen/r1.eds"


def run(*only: str, level: Level = Level.COMMUNICATION) -> Report:
    return R1().judge(ConformancePlan(level, only))


def test_r1_starts_stops_and_enters_pre_operational() -> None:
    report = run("NMT-0[345]")
    assert [(r.check.id, r.outcome.verdict) for r in report.results] == [
        ("NMT-03", CheckVerdict.PASS),
        ("NMT-04", CheckVerdict.PASS),
        ("NMT-05", CheckVerdict.PASS),
    ]
    assert report.unrestored == ()


def test_a_check_beyond_the_level_is_not_run() -> None:
    assert not any(r.check.level > Level.READ_ONLY for r in run(level=Level.READ_ONLY).results)


def reasons(check_id: str, eds: Path | None = None, device: Path | str = R1_EDS) -> list[str]:
    report = Judged.of(device).judge(ConformancePlan(Level.COMMUNICATION, (check_id,)), eds)
    return [f"{r.outcome.verdict}: {r.outcome.reason}" for r in report.results]


def test_the_default_sdo_server_is_asked_for_without_an_eds() -> None:
    assert reasons("UE-11") == ["pass: "]
    assert reasons("DE-16") == ["pass: "]


def test_what_nobody_asked_for_is_not_said_to_be_missing(tmp_path: Path) -> None:
    assert reasons("UE-09") == [
        "not applicable: without an EDS there is no known write-only object"
    ]
    assert reasons("D4-02", device="epos") == [
        "not applicable: without an EDS there is no known 6040h:00"
    ]
    eds = tmp_path / "less.eds"
    eds.write_text(R1_EDS.read_text("utf-8").replace("[1200", "[11F0"), "utf-8")
    assert reasons("UE-11", eds) == ["not applicable: the EDS has no 1200h:01"]


def test_what_is_found_is_told_once() -> None:
    identity = [EntryDescription(0x1018, sub, "", DataType.UNSIGNED32, RO) for sub in range(1, 6)]
    count = EntryDescription(0x1018, 0, "", DataType.UNSIGNED8, RO, default=4)
    kind = EntryDescription(0x1000, 0, "", DataType.UNSIGNED32, RO)
    slave = make_slave(Dictionary([kind, count, *identity]), 5)
    found = Judged(slave).judge(ConformancePlan()).findings
    assert [text for text in found if "1018h:05" in text] == [
        "1018h:05 cannot be there, but the node has it"
    ]
