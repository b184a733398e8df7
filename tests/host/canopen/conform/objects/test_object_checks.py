from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

import pytest

from tests.host.canopen.conform.bench import NODE_ID, Bench, make_bench
from tests.host.canopen.data_sheet.corpus import GOOD, counted_only
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.canopen.eds import read_eds
from tickrig.host.canopen.conform.bus.exchange import StepFailed
from tickrig.host.canopen.conform.bus.steps import play_of_object
from tickrig.host.canopen.conform.check import (
    Check,
    Hold,
    Level,
    RefuseRead,
    RefuseRewrite,
    RefuseWrite,
)
from tickrig.host.canopen.conform.notation import bind_check
from tickrig.host.canopen.conform.object_checks import object_checks
from tickrig.host.canopen.eds import read_sound
from tickrig.host.canopen.errors import SdoAborted
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import (
    CONST,
    RO,
    RW,
    WO,
    Access,
    DeviceInfo,
    EntryDescription,
)

ROOT = Path(__file__).parents[5]
FILES = [
    ROOT / "tests/golden/canopen/r1.eds",
    ROOT / "tests/emulators/canopen/eds/sample.dcf",
    *sorted((ROOT / "examples").rglob("*.eds")),
]
PROFILE = range(0x6000, 0xA000)


class NoNames:
    """Checks of objects name nothing."""

    def text(self, name: str, attribute: str, /) -> str:
        return {"request": "605", "sync": "080"}[name]

    def address(self, name: str, /) -> tuple[int, int]:
        raise AssertionError(name)


def play(bench: Bench, check: Check) -> None:
    """Play the steps of a check; StepFailed as in a run."""
    for step in bind_check(check, NoNames()).steps:
        match step.action:
            case Hold() | RefuseRewrite() as action:
                play_of_object(bench.client, action)
            case RefuseRead() | RefuseWrite() as action:
                play_refusal(bench, action)


def play_refusal(bench: Bench, action: RefuseRead | RefuseWrite) -> None:
    try:
        if isinstance(action, RefuseWrite):
            bench.client.download(*action.address, bytes.fromhex(action.data))
        else:
            bench.upload(*action.address)
    except SdoAborted as error:
        if f"{error.code:08X}" not in action.codes:
            raise StepFailed(str(error)) from error
    else:
        raise StepFailed(f"{action} was not refused")


def failures(bench: Bench, checks: Collection[Check]) -> Iterator[str]:
    for check in checks:
        try:
            play(bench, check)
        except StepFailed as error:
            yield f"{check.id} {error}"


def entry(  # noqa: PLR0913 - a row, by keyword
    kind: DataType,
    access: Access,
    default: Value | None = None,
    *,
    index: int = 0x2000,
    sub: int = 0,
    low: int | None = None,
    high: int | None = None,
) -> EntryDescription:
    return EntryDescription(
        *(index, sub, "Gain", kind, access), default=default, low=low, high=high
    )


def compare(
    described: Collection[EntryDescription], there: Collection[EntryDescription]
) -> list[str]:
    """Judge a node that has other objects than its EDS; give the checks that fail."""
    bench = make_bench(Dictionary(there))
    device = EdsDevice(DeviceInfo(), tuple(described), {})
    return list(failures(bench, object_checks(device, NODE_ID)))


U8 = DataType.UNSIGNED8
U16 = DataType.UNSIGNED16
U32 = DataType.UNSIGNED32


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_slave_of_ours_is_as_its_eds_declares(path: Path) -> None:
    bench = make_bench(read_eds(path).make_dictionary())
    checks = object_checks(read_sound(path)[0], NODE_ID, allow=PROFILE)
    before = [entry.data for entry in bench.slave.dictionary]
    assert list(failures(bench, checks)) == []
    assert [entry.data for entry in bench.slave.dictionary] == before


def test_pdos_that_an_eds_only_counts_are_there(tmp_path: Path) -> None:
    path = tmp_path / "counted.eds"
    path.write_text(counted_only(GOOD), "utf-8")
    bench = make_bench(read_eds(path).make_dictionary())
    assert bench.upload(0x1403, 1) == b"\x05\x05\0\0"
    assert list(failures(bench, object_checks(read_sound(path)[0], NODE_ID))) == []
    full = make_bench(read_eds(FILES[0]).make_dictionary())
    checks = {check.id: check for check in object_checks(read_sound(path)[0], NODE_ID)}
    assert list(failures(full, [checks["OD-absent"], checks["OD-1403.01-type"]])) == []


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_checks_are_the_same_each_time_and_their_names_differ(path: Path) -> None:
    device = read_sound(path)[0]
    checks = object_checks(device, NODE_ID)
    assert checks == object_checks(device, NODE_ID)
    assert len({check.id for check in checks}) == len(checks)
    assert all(check.source and check.title for check in checks)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_who_only_reads_has_no_step_that_writes(path: Path) -> None:
    for check in object_checks(read_sound(path)[0], NODE_ID, allow=PROFILE):
        writes = [
            step for step in check.steps if isinstance(step.action, RefuseWrite | RefuseRewrite)
        ]
        assert bool(writes) == (check.level is Level.COMMUNICATION)


def test_objects_of_the_profile_are_written_only_if_they_are_allowed() -> None:
    output = entry(U8, RW, index=0x6200, sub=1, high=9)
    device = EdsDevice(DeviceInfo(), (output,), {})
    written = [
        check.id
        for check in object_checks(device, NODE_ID, allow={0x6200})
        if check.level is not Level.READ_ONLY
    ]
    assert written == ["OD-6200.01-long", "OD-6200.01-high"]
    for checks in (
        object_checks(device, NODE_ID),
        object_checks(device, NODE_ID, allow={0x6200}, never={0x6200}),
    ):
        assert all(check.level is Level.READ_ONLY for check in checks)


def test_every_sub_index_is_read_in_some_object() -> None:
    checks = object_checks(read_sound(FILES[0])[0], NODE_ID)
    actions = [step.action for check in checks for step in check.steps]
    read = {action.address[1] for action in actions if isinstance(action, RefuseRead | Hold)}
    assert read == set(range(256))


def test_store_and_restore_are_never_written() -> None:
    checks = object_checks(read_sound(FILES[0])[0], NODE_ID)
    assert "OD-1010.01-type" in {check.id for check in checks}
    assert not {"OD-1010.01-long", "OD-1011.01-short"} & {check.id for check in checks}


@pytest.mark.parametrize(
    ("described", "there", "failed"),
    [
        (entry(U32, RW), entry(U16, RW), ["type 2 bytes, want 4 of UNSIGNED32"]),
        (entry(U8, RW, high=9), entry(U8, RW, 10), ["type 10 is above its upper limit 9", "high"]),
        (entry(U8, RW, low=9), entry(U8, RW), ["type 0 is below its lower limit 9", "low"]),
        (entry(U8, CONST, 5), entry(U8, CONST, 6), ["type holds 06, want 05"]),
        (entry(U8, WO), entry(U8, RW), ["read "]),
        (entry(U8, RO), entry(U8, RW), ["write 1 bytes were accepted, want abort 0601 0002h"]),
        (entry(U8, RW), entry(DataType.VISIBLE_STRING, RW), ["type 0 bytes", "long 1 bytes were"]),
        (
            *(entry(U16, RW), entry(DataType.VISIBLE_STRING, RW, "ab")),
            ["long 3 bytes were accepted", "short 2 bytes were accepted"],
        ),
        (
            *(entry(U8, RW), entry(U8, WO)),
            ["type refused with object is write only (06010001h), want its value"],
        ),
    ],
)
def test_a_node_that_is_other_than_described_fails(
    described: EntryDescription, there: EntryDescription, failed: list[str]
) -> None:
    found = compare([described], [there])
    assert len(found) == len(failed)
    for text, start in zip(found, failed, strict=True):
        assert text.startswith(f"OD-2000.00-{start}")


def test_what_is_not_described_is_found() -> None:
    head, hidden = entry(U8, RO, 1), entry(U8, RO, sub=2)
    assert [text[:12] for text in compare([head], [head, hidden])] == ["OD-2000-subs"]
    behind = entry(U8, RO, index=0x2001)
    assert [text[:9] for text in compare([head], [head, behind])] == ["OD-absent"]


def test_the_structure_of_an_object_may_be_told_at_ff() -> None:
    head = entry(U8, RO, 1)
    assert compare([head], [head, entry(U32, RO, 0x0705, sub=0xFF)]) == []
    assert len(compare([head], [head, entry(U8, RO, 7, sub=0xFF)])) == 1


def test_the_highest_sub_index_has_no_next_one() -> None:
    rows = [entry(U8, RO, 1), entry(U32, RO, sub=0xFE), entry(U32, RO, sub=0xFF)]
    assert compare(rows, rows) == []


def test_the_reserved_sub_index_of_a_pdo_may_be_described() -> None:
    rows = [entry(U8, RO, 4, index=0x1400), entry(U8, RW, 0, index=0x1400, sub=4)]
    assert compare(rows, rows) == []


def test_what_is_missing_is_found() -> None:
    failed = compare([entry(U16, RW)], [entry(U16, RW, index=0x3000)])
    assert failed[0].startswith("OD-2000.00-type refused with object does not exist")


def test_a_pdo_default_with_the_node_id_is_compared() -> None:
    row = EntryDescription(0x1800, 1, "COB-ID", U32, RW, default=0x180, relative=True)
    device = EdsDevice(DeviceInfo(), (row,), {})
    bench = make_bench(Dictionary([row]))
    checks = {check.id: check for check in object_checks(device, NODE_ID)}
    default = checks["OD-1800.01-default"]
    assert default.choice.startswith("the node may have been configured")
    play(bench, default)
    bench.slave.dictionary[0x1800, 1].value = 0x181
    with pytest.raises(StepFailed, match="holds 81010000, want 85010000"):
        play(bench, default)


@pytest.mark.parametrize(
    ("device_type", "objects", "missing"),
    [
        (0x0001_0191, [(0x6000, U8)], ""),
        (0x0001_0191, [(0x6020, U8)], ""),
        (0x0003_0191, [(0x6000, U8)], "6200"),
        (0x0002_0192, [(0x6040, U16), (0x6041, U16)], ""),
        (0x0002_0192, [(0x6040, U16)], "6041"),
        (0x0000_0000, [], ""),
    ],
)
def test_a_device_has_the_objects_of_its_profile(
    device_type: int, objects: list[tuple[int, DataType]], missing: str
) -> None:
    rows = [entry(U32, RO, device_type, index=0x1000)]
    rows += [entry(kind, RW, index=index) for index, kind in objects]
    failed = compare(rows, rows)
    assert bool(failed) == bool(missing)
    assert all(text.startswith("OD-1000.00-profile refused") for text in failed)


def test_a_node_that_stops_answering_fails() -> None:
    bench = make_bench(Dictionary([entry(U8, RW)]))
    device = EdsDevice(DeviceInfo(), (entry(U8, RW),), {})
    bench.wire.faults.arm("short")
    with pytest.raises(StepFailed, match="2000h:00 was not answered"):
        play(bench, object_checks(device, NODE_ID)[0])
