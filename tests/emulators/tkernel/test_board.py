"""A board in virtual time: boot, power loss, what is left after it."""

from __future__ import annotations

from contextlib import ExitStack

import pytest

from tests.host.rtc.ucode.bench import DOOR, UcodeBench
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.tkernel.board import Board
from tickrig.emulators.tkernel.node_manager import (
    CONTENTS,
    SETTLEMENT,
    BoardLines,
    NodeLimits,
    NodeManager,
    add_position_detection,
)
from tickrig.emulators.tkernel.operated import Operated
from tickrig.emulators.tkernel.resolution import opener
from tickrig.host.control.requests import Object
from tickrig.host.rtc.system.schedule import Schedule
from tickrig.wire.instant import NEVER

SECOND_US = 1_000_000


class BoardBench:
    """A board with the components of position detection, its reader and its service."""

    def __init__(self, **limits: int) -> None:
        self.ucode = ucode = UcodeBench()
        ucode.run(20_000)
        ucode.manager.deactivate("Rays0", "Settlement0", "Contents0")
        ucode.run(20_000)
        source = opener(ucode.service)
        self.lines = BoardLines(lambda name: ucode.link(), lambda name: ucode.link(), source)
        self.left = 0
        self.board = Board(NodeLimits(**limits), self._start, self.lines)
        self.operated = Operated("node", self.board)
        self.schedule = Schedule()
        self.schedule.add_item(self.operated)
        self.schedule.add_item(self.board)

    def _start(self, manager: NodeManager, stack: ExitStack) -> None:
        add_position_detection(manager, self.lines, "", self.ucode.service.base)
        stack.callback(self._leave)

    def _leave(self) -> None:
        self.left += 1

    def run(self, until_us: int) -> None:
        schedule = self.schedule
        while schedule.due_us <= until_us:
            self.ucode.rig.run_to(max(schedule.due_us, self.ucode.rig.now_us))
            schedule.tick(schedule.due_us)
        self.ucode.rig.run_to(until_us)
        schedule.tick(until_us)

    def request(self, do: str, **fields: object) -> Object:
        return EmulatorControl(self.operated).answer({"v": 1, "do": do, **fields})


def test_it_answers_after_its_boot_time() -> None:
    bench = BoardBench()
    assert bench.board.due_us == 0
    bench.run(2_999_000)
    assert (bench.board.read("state"), bench.board.manager) == (1, None)
    bench.run(3_000_000)
    assert (bench.board.read("state"), bench.board.read("components")) == (2, 3)
    bench.run(4 * SECOND_US)
    manager = bench.board.manager
    assert manager is not None
    assert manager.find(CONTENTS).cache.counts.hits > 5  # type: ignore[attr-defined]


def test_a_power_cut_loses_all_and_a_boot_makes_it_anew() -> None:
    bench = BoardBench()
    bench.run(5 * SECOND_US)
    first = bench.board.manager
    bench.request("fault", spec="power_cut@6s-7s")
    bench.run(6 * SECOND_US)
    assert (bench.board.read("state"), bench.board.read("components")) == (0, 0)
    assert (bench.board.due_us, bench.left) == (NEVER, 1)
    assert bench.ucode.reader.read("listening") == 1  # nobody told it anything
    bench.run(9_900_000)
    assert bench.board.read("state") == 1
    bench.run(12 * SECOND_US)
    second = bench.board.manager
    assert second is not first
    assert second is not None
    assert (bench.board.read("state"), bench.board.read("boots")) == (2, 2)
    counts = second.find(SETTLEMENT).cache.counts  # type: ignore[attr-defined]
    assert counts.misses == 1  # its cache was gone


def test_a_cut_while_it_boots_begins_anew() -> None:
    bench = BoardBench()
    bench.run(2 * SECOND_US)
    bench.board.inputs.set("power_cut", 1)
    bench.run(2_100_000)
    bench.board.inputs.set("power_cut", 0)
    bench.run(5_000_000)
    assert bench.board.read("state") == 1
    bench.run(5_200_000)
    assert bench.board.read("state") == 2


def test_the_reset_button_boots_it() -> None:
    bench = BoardBench(boot_us=0)
    bench.run(SECOND_US)
    bench.request("press", name="reset")
    bench.run(1_050_000)
    assert bench.board.read("state") == 0
    bench.run(2 * SECOND_US)
    assert (bench.board.read("state"), bench.board.read("boots")) == (2, 2)


def test_refusals_are_counted_over_boots() -> None:
    bench = BoardBench(boot_us=0, message_octets=50)
    bench.run(2 * SECOND_US)
    before = bench.board.read("refused_messages")
    assert before > 5
    bench.request("set", name="power_cut", value=1)
    bench.run(3 * SECOND_US)
    assert bench.board.read("refused_messages") >= before
    assert bench.request("get", names=["refused_messages", "power_cut"])["ok"]


def test_at_the_end_components_are_deactivated() -> None:
    bench = BoardBench(boot_us=0)
    bench.run(SECOND_US)
    bench.board.close()
    bench.ucode.rig.run_for(100_000)
    assert bench.ucode.reader.read("listening") == 0
    assert bench.left == 1
    bench.board.close()
    assert bench.left == 1


@pytest.mark.parametrize(
    ("do", "fields", "error"),
    [
        ("get", {"names": ["speed"]}, 'no input or output "speed"; known: state'),
        ("get", {"names": 1}, "names is a list of names, not 1"),
        ("set", {"name": "reset", "value": None}, "value is a number or a string, not null"),
        ("press", {"name": "power_cut"}, "no button 'power_cut'"),
        ("fault", {"spec": "fire"}, "no fault 'fire'"),
        ("clear", {"name": "fire"}, "no fault 'fire'"),
        ("lines", {}, 'no request "lines"'),
    ],
)
def test_what_cannot_be_done_is_refused(do: str, fields: dict[str, object], error: str) -> None:
    answer = BoardBench().request(do, **fields)
    assert answer["ok"] is False
    assert str(answer["error"]).startswith(error)


def test_it_is_described_as_an_emulator_is() -> None:
    bench = BoardBench()
    described = bench.request("describe")
    assert described["wire_faults"] == []
    assert {"reset", "power_cut"} == {each["name"] for each in described["inputs"]}  # type: ignore[attr-defined]
    bench.request("set", name="power_cut", value=1)
    assert bench.request("status")["faults"] == ["power_cut"]
    assert bench.request("clear", name="power_cut")["ok"]
    assert bench.request("stop")["ok"]


def test_the_same_run_is_the_same() -> None:
    def run() -> list[object]:
        bench = BoardBench()
        bench.request("fault", spec="power_cut@5s-6s")
        bench.run(12 * SECOND_US)
        assert bench.board.manager is not None
        settlement = bench.board.manager.find(SETTLEMENT)
        return [settlement.cache.counts, bench.board.boots, DOOR]  # type: ignore[attr-defined]

    assert run() == run()
