from __future__ import annotations

import re
import struct
import sys
from collections.abc import Callable
from fnmatch import fnmatchcase
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from tests.emulators.testing.conformance.stacks import R1_EDS, durand, local_node, ours
from tickrig.device import make_epos
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import SERVICES
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.conformance.bench_source import open_rig
from tickrig.emulators.testing.conformance.conformance import conformance
from tickrig.emulators.testing.conformance.slave import Slave, SlaveCall
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.report.report_json import report_json
from tickrig.host.canopen.conform.verdict import CheckVerdict, Report
from tickrig.wire.can import CanFrame, Frames

NMT = "NMT-0[345]"
REASON = "your slave raised struct.error: unpack requires a buffer of 2 bytes"


@pytest.mark.parametrize("make", [ours, local_node, durand])
def test_any_stack_is_judged_in_virtual_time(make: Callable[[], Slave]) -> None:
    report = conformance(make(), node_id=5, eds=R1_EDS, only=NMT)
    assert [result.outcome.verdict for result in report.results] == [CheckVerdict.PASS] * 3


def test_a_slave_of_ours_tells_of_itself() -> None:
    report = conformance(make_epos(7), only=NMT)
    assert (report.node_id, report.exit_status) == (7, 0)


def test_one_check_makes_only_what_it_needs() -> None:
    """The second run in a process: 118 000 calls when all checks were made and the EDS written."""
    calls = 0

    def count(frame: FrameType, event: str, argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    for _ in range(2):
        calls, before = 0, sys.getprofile()
        with Bench(ours()) as bench:
            sys.setprofile(count)
            try:
                report = conformance(bench, only="UE-01", level="read-only")
            finally:
                sys.setprofile(before)
        assert report.exit_status == 0
    assert calls < 40_000


def test_a_device_of_a_bench_is_judged_beside_others() -> None:
    with Bench(left=make_epos(1), right=make_epos(2)) as bench:
        report = conformance(bench["right"], only=NMT)
        assert (report.node_id, report.exit_status) == (2, 0)
        assert bench["left"].get("state") == "Pre-operational"


TWO_BUSES = """\
[wire.one]
type = "can"
[wire.two]
type = "can"
[device.left]
type = "epos"
wire = "one"
node_id = 5
[device.right]
type = "epos"
wire = "two"
node_id = {right}
[device.remote]
type = "rrc"
"""


def two_buses(tmp_path: Path, right: int = 6) -> Path:
    path = tmp_path / "two.toml"
    path.write_text(TWO_BUSES.format(right=right))
    return path


def test_a_device_of_a_bench_is_judged_on_its_own_bus(tmp_path: Path) -> None:
    with Bench.of_plan(read_rig_file(two_buses(tmp_path))) as bench:
        report = conformance(bench["right"], only="NMT-03")
    assert (report.node_id, report.source, report.exit_status) == (6, "two", 0)


def test_a_bench_is_asked_only_for_nodes_that_it_has(tmp_path: Path) -> None:
    with Bench.of_plan(read_rig_file(two_buses(tmp_path))) as bench:
        for node_id in (6, 9):
            with pytest.raises(ValueError, match=f"of left has no node {node_id}; its nodes: 5$"):
                conformance(bench["left"], node_id=node_id)
        with pytest.raises(ValueError, match="remote is no CANopen node"):
            conformance(bench["remote"])


def test_one_node_id_on_two_buses_is_refused(tmp_path: Path) -> None:
    path = two_buses(tmp_path, right=5)
    with pytest.raises(ValueError, match="has a node 5 on each of one, two: leave one"):
        open_rig(path, 5)
    with Bench.of_plan(read_rig_file(path)) as bench:
        assert conformance(bench["right"], only="NMT-03").source == "two"


def test_a_node_has_not_failed_because_another_one_answers() -> None:
    with Bench(left=make_epos(1), right=make_epos(2)) as bench:
        report = conformance(bench["right"], only=("LS-02", "NMT-03"))
        verdicts = [result.outcome.verdict for result in report.results]
        assert sorted(verdicts) == [CheckVerdict.NOT_APPLICABLE, CheckVerdict.PASS]


def test_a_bare_callable_is_judged() -> None:
    def make() -> SlaveCall:
        def call(now_us: int, frames: Frames) -> Frames:
            asked = [frame for frame in frames if frame.can_id == 0x603]
            answer = bytes.fromhex("8000100000000206")
            return tuple(CanFrame(0x583, answer) for _ in asked)

        return call

    report = conformance(make, node_id=3, only="UE-01")
    assert [result.outcome.verdict for result in report.results] == [CheckVerdict.FAIL]


class Fragile:
    """A slave of ours whose program does not expect an NMT command of one byte."""

    def __init__(self) -> None:
        self.slave, self.tick_us, self.resets = ours(), 1_000, 0

    @property
    def due_us(self) -> int:
        return self.slave.due_us

    def reset(self) -> None:
        self.resets += 1
        self.slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        for frame in rx:
            if frame.can_id == 0:
                struct.unpack("<BB", frame.data)
        return self.slave.tick(now_us, rx)


def test_what_a_slave_raises_is_the_verdict_and_the_others_go_on() -> None:
    fragile = Fragile()
    report = conformance(fragile, node_id=5, eds=R1_EDS, only="NMT-*")
    failed = [result for result in report.results if result.outcome.verdict is CheckVerdict.FAIL]
    assert failed
    for result in failed:
        reason = rf"step \d+: {REASON}"
        assert re.fullmatch(reason, result.outcome.reason)
        remarks = [line.text for line in result.outcome.evidence if line.direction == "#"]
        assert any("in tick: struct.unpack" in text for text in remarks), remarks
    assert report.count(CheckVerdict.PASS) > len(failed)
    assert report.count(CheckVerdict.BLOCKED) == 0
    assert report.findings[0].startswith("your slave raised struct.error")
    assert fragile.resets >= 2 * len(failed), "each is tried again, and it begins anew"
    assert report.unrestored == ()


class Strict(CanopenSlave):
    """A slave of ours with a mistake of its user: as `Fragile`."""

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        for frame in rx:
            if frame.can_id == 0:
                struct.unpack("<BB", frame.data)
        return super().tick(now_us, rx)


def strict(node_id: int) -> Strict:
    return Strict(make_epos(node_id).dictionary, node_id, SERVICES)


def raised(report: Report) -> set[str]:
    """Return the checks in which a program of a node raised."""
    return {result.check.id for result in report.results if "raised" in result.outcome.reason}


def test_what_a_slave_of_ours_raises_is_the_verdict_too() -> None:
    report = conformance(strict(5), only="NMT-0*")
    assert raised(report) == {"NMT-09"}
    reasons = [result.outcome for result in report.results if result.check.id == "NMT-09"]
    assert [(each.verdict, each.reason) for each in reasons] == [
        (
            CheckVerdict.FAIL,
            "step 4: your slave raised struct.error: unpack requires a buffer of 2 bytes",
        )
    ]
    assert report.findings[0].startswith("your slave raised struct.error")
    assert report.count(CheckVerdict.PASS) > 3
    assert (report.exit_status, report.unrestored) == (1, ())


def test_a_device_of_a_bench_that_raises_ends_no_run() -> None:
    with Bench(left=make_epos(1), right=strict(2)) as bench:
        report = conformance(bench["right"], only="NMT-0*")
        assert raised(report) == {"NMT-09"}
        bench.canopen_network().send_message(0, b"\x01")
        with pytest.raises(struct.error):
            bench.run_for("10ms")


def test_what_the_hands_raise_is_no_failure_of_the_slave() -> None:
    def hands(*words: str) -> str:
        raise KeyError(words[0])

    report = conformance(Fragile(), node_id=5, eds=R1_EDS, only="PR-01", stimulus=hands)
    (result,) = report.results
    assert result.outcome.verdict is CheckVerdict.INCONCLUSIVE
    assert result.outcome.reason == "the stimulus raised KeyError: 'input'"


def test_another_device_of_a_bench_that_raises_accuses_nobody() -> None:
    with Bench(left=strict(1), right=make_epos(2)) as bench:
        report = conformance(bench["right"], only="NMT-0*")
        assert report.count(CheckVerdict.FAIL) == 0
        disturbed = [line.text for each in report.results for line in each.outcome.evidence]
        assert any(text.startswith("left raised struct.error") for text in disturbed)


def test_a_slave_that_raises_from_the_beginning_ends_the_run() -> None:
    def make() -> SlaveCall:
        def call(now_us: int, frames: Frames) -> Frames:
            raise RuntimeError(f"at {now_us}")

        return call

    report = conformance(make, node_id=3, only="NMT-03")
    assert report.exit_status == 4
    assert report.findings[0] == "your slave raised RuntimeError: at 1000"
    assert len(report.findings) < 30


def test_a_slave_that_cannot_begin_anew_is_dead() -> None:
    made = []

    def make() -> SlaveCall:
        made.append(1)
        if len(made) > 1:
            raise ValueError("no second time")

        def call(now_us: int, frames: Frames) -> Frames:
            raise RuntimeError("once")

        return call

    report = conformance(make, node_id=3, only="NMT-03")
    assert report.findings[1] == "your slave raised ValueError: no second time"


class Machine:
    """A slave as somebody writes one: called with time and frames, made anew at power-on."""

    def step(self, now_us: int, frames: Frames) -> Frames:
        return ()


@pytest.mark.parametrize(
    ("node", "why"),
    [
        (Machine().step, r"Machine\.step takes a time and frames: give what makes the slave"),
        (Machine, "Machine makes Machine, which takes no time and frames: give what makes"),
        (lambda: Machine, "Machine, which takes no time and frames"),
        (Machine(), "Machine is no slave: it has no tick, due_us, tick_us, reset; give what"),
        (Fragile, "Fragile makes a slave: give the slave itself"),
        (lambda: make_epos(5), "makes a slave: give the slave itself"),
    ],
)
def test_what_is_no_slave_is_told_with_what_to_give(node: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        conformance(node, node_id=5)


@pytest.mark.parametrize(
    ("sent", "said"),
    [
        (None, "returned None, not a list of CanFrame"),
        (CanFrame(0x705), "returned CanFrame(can_id=1797, *), not a list of CanFrame"),
        ([1], "returned 1 where a CanFrame should be"),
        ([b"\0"], r"returned b'\x00' where a CanFrame should be"),
        ([CanFrame(0x705, "7F")], "returned CanFrame(*): can_id is an int, data are bytes"),  # type: ignore[arg-type]
        ([CanFrame(0x905)], "returned CanFrame(*): CAN-ID 0x905 is not 11-bit"),
        ([CanFrame(0x705, bytes(9))], "returned CanFrame(*): a frame of 9 bytes, at most 8 fit"),
    ],
)
def test_what_is_no_frame_is_told_as_what_the_slave_returned(sent: Any, said: str) -> None:
    def make() -> SlaveCall:
        return lambda now_us, frames: sent

    report = conformance(make, node_id=5, only="UE-01")
    assert fnmatchcase(report.findings[0], f"your slave {said}")
    lines = [line.text for each in report.results for line in each.outcome.evidence]
    assert not any("called_slave.py" in text for text in lines)


def test_frames_may_come_from_a_generator() -> None:
    def make() -> SlaveCall:
        def call(now_us: int, frames: Frames) -> Any:
            yield from (CanFrame(0x705, bytearray(1)) for frame in frames)  # type: ignore[arg-type]

        return call

    report = conformance(make, node_id=5, only="NMT-03")
    assert report.findings == ()


def test_the_same_slave_gives_the_same_bytes() -> None:
    first, again = (report_json(conformance(ours(), only=NMT)) for _ in range(2))
    assert first == again


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="level 'careful' is not one of read-only"):
        conformance(make_epos(5), level="careful")
    with pytest.raises(ValueError, match=r"node_id is 1\.\.127, not None"):
        conformance(local_node())
    for only in ("XX", "NMT,NTM", "", ["NMT", "NMT-99"]):
        with pytest.raises(ValueError, match="no such group or check"):
            conformance(make_epos(5), only=only)
    with pytest.raises(OSError, match=r"nosuch\.eds"):
        conformance(make_epos(5), eds="nosuch.eds")
    with Bench(make_epos(5), mode="real") as bench, pytest.raises(ValueError, match="virtual time"):
        conformance(bench)


def test_several_groups_may_be_one_word() -> None:
    report = conformance(make_epos(5), only="NMT-03,UE-01")
    assert [result.check.id for result in report.results] == ["UE-01", "NMT-03"]


def test_the_level_is_intrusive_unless_given() -> None:
    assert conformance(make_epos(5), only="NMT-03").level is Level.INTRUSIVE
    assert "The default is `intrusive`" in (conformance.__doc__ or "")
