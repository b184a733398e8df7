"""What is kept before a trigger, and recorded behind it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.model.recorder.bench import (
    GAP_US,
    events,
    feed,
    frames_of,
    numbers,
    parts,
    record,
)
from tickrig.host.canmon.model.check.checker import Alarms
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.log_file import gone
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.recorder.files import (
    MAX_PRE_FRAMES,
    RecordingPlan,
    TriggerSpan,
    read_plan,
)
from tickrig.host.canmon.model.recorder.recorder import (
    FilterTrigger,
    PreTrigger,
    Recorder,
    RecorderState,
    RuleTrigger,
    Trigger,
)
from tickrig.wire.can import CanFrame

EMCY = 0x085


def plan_of(folder: Path, pre: str, post: str, **more: object) -> RecordingPlan:
    return read_plan(folder / "run.log", pre=pre, post=post, waits=True, **more)  # type: ignore[arg-type]


def trigger(text: str) -> FilterTrigger:
    return FilterTrigger(text, parse_filter(text))


def state(recorder: Recorder) -> RecorderState:
    return recorder.state


def traffic(count: int, *emcys: int) -> list[Record]:
    return [record(number, EMCY if number in emcys else 0x181) for number in range(count)]


def recorded(
    plan: RecordingPlan, records: list[Record], *triggers: Trigger, batch: int = 100
) -> Recorder:
    recorder = Recorder(plan, 0, triggers)
    feed(recorder, records, batch=batch)
    recorder.close()
    return recorder


@pytest.mark.parametrize("batch", [1, 7, 100, 1_000])
@pytest.mark.parametrize(
    ("pre", "post"), [("10", "20"), (f"{10 * GAP_US / 1e3}ms", f"{20 * GAP_US / 1e3}ms")]
)
def test_frames_around_a_trigger_are_in_a_file_of_their_own(
    pre: str, post: str, batch: int, tmp_path: Path
) -> None:
    plan = plan_of(tmp_path, pre, post)
    recorder = recorded(plan, traffic(1_000, 100, 500), trigger("emcy"), batch=batch)
    each = [numbers(read_log(path)) for path in parts(plan)]
    assert each == [list(range(90, 121)), list(range(490, 521))]
    first, second = events(plan, "trigger")
    assert (first["t"], first["file"]) == (100 * GAP_US / 1e6, "run-00001.log")
    assert first["text"].startswith(f"trigger: emcy: can0 {record(100, EMCY).frame}, 5 emcy ")
    assert second["file"] == "run-00002.log"
    assert [said["triggers"] for said in events(plan, "file")] == [1, 1]
    assert recorder.messages() == [f"62 frames in 2 files, 2 triggers; {plan.index}"]


def test_a_trigger_behind_another_goes_on_with_the_file(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "10", "20")
    recorder = recorded(plan, traffic(1_000, 100, 115), trigger("emcy"))
    assert (frames_of(plan), len(parts(plan))) == (list(range(90, 136)), 1)
    assert (recorder.triggers, len(events(plan, "trigger"))) == (2, 1)


def test_what_was_recorded_once_is_not_recorded_again(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "1000", "5")
    recorded(plan, traffic(300, 100, 150), trigger("emcy"))
    assert frames_of(plan) == list(range(156))


def test_without_a_trigger_there_is_no_file(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "10", "10")
    recorder = recorded(plan, traffic(1_000), trigger("emcy"))
    assert parts(plan) == []
    assert recorder.messages() == [f"0 frames in 0 files, 0 triggers; {plan.index}"]


def test_nothing_before_and_nothing_behind_is_the_frame_alone(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "0", "0")
    recorded(plan, traffic(100, 50), trigger("emcy"))
    assert frames_of(plan) == [50]


def test_a_key_is_a_trigger_too(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "5", "5")
    recorder = Recorder(plan)
    assert state(recorder) is RecorderState.WAITING
    feed(recorder, traffic(100))
    recorder.trigger("key", 99 * GAP_US)
    assert state(recorder) is RecorderState.RECORDING
    feed(recorder, [record(number) for number in range(100, 200)])
    assert state(recorder) is RecorderState.WAITING
    recorder.close()
    assert frames_of(plan) == list(range(94, 105))
    assert "# trigger: key" in parts(plan)[0].read_text().splitlines()


def test_time_alone_ends_what_comes_behind_a_trigger(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "5", "1s")
    recorder = Recorder(plan)
    recorder.trigger("key", 1_000_000)
    recorder.take([], 0, 2_500_000)
    assert state(recorder) is RecorderState.RECORDING  # a frame may be late
    recorder.take([], 0, 3_000_001)
    assert state(recorder) is RecorderState.WAITING
    recorder.close()


def test_a_broken_rule_is_a_trigger(tmp_path: Path) -> None:
    rules = parse_rules({"known": "181"})
    plan = plan_of(tmp_path, "2", "2")
    recorded(plan, traffic(100, 50), RuleTrigger("rules.toml", Alarms(rules)))
    assert frames_of(plan) == list(range(48, 53))
    (said,) = events(plan, "trigger")
    assert said["text"].startswith("trigger: known: ")


def test_what_is_missing_by_a_rule_is_a_trigger(tmp_path: Path) -> None:
    alarms = Alarms(parse_rules({"heartbeat": ["3=100ms±20%"]}))
    plan = plan_of(tmp_path, "2", "1s")
    recorder = Recorder(plan, 0, [RuleTrigger("rules.toml", alarms)])
    beats = [
        Record(at_us, "can0", CanFrame(0x703, b"\x05")) for at_us in range(0, 500_000, 100_000)
    ]
    feed(recorder, beats, batch=1)
    for now_us in range(500_000, 5_000_000, 50_000):
        recorder.take([], 0, now_us)
    recorder.close()
    (said,) = events(plan, "trigger")
    assert "heartbeat" in said["text"]
    assert said["t"] <= 2.1
    assert len(list(read_log(parts(plan)[0]))) == 3


def test_a_trigger_sees_frames_that_are_not_recorded(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "2", "2")
    recorder = Recorder(plan, 0, [trigger("emcy")], trigger("181"))
    feed(recorder, traffic(100, 50))
    recorder.close()
    assert frames_of(plan) == [47, 48, 49, 51, 52]


def test_only_what_is_wanted_is_recorded(tmp_path: Path) -> None:
    recorder = Recorder(RecordingPlan(path=tmp_path / "run.log"), 0, [], trigger("emcy"))
    feed(recorder, traffic(100, 50, 60))
    recorder.close()
    assert numbers(read_log(tmp_path / "run.log")) == [50, 60]


def test_a_gap_before_a_trigger_stands_at_its_place(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "5", "0")
    recorder = Recorder(plan, 0, [trigger("emcy")])
    feed(recorder, traffic(10), marks=[gone(10**15, "can0", "x")])
    feed(recorder, [record(10), record(11, EMCY)])
    recorder.close()
    lines = parts(plan)[0].read_text().splitlines()
    assert [line[0] for line in lines] == ["(", "(", "(", "(", "#", "(", "(", "#"]
    assert len(events(plan, "gone")) == 1


def test_a_signal_that_never_came_is_told(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "5", "0")
    recorder = recorded(plan, traffic(10), trigger("9.statusword.fault"))
    assert recorder.messages()[0] == "the filter asks for '9.statusword.fault': no such signal came"


def test_a_long_time_before_a_trigger_is_cut_where_too_many_frames_come() -> None:
    before = PreTrigger(TriggerSpan(None, 3_600_000_000))
    for number in range(MAX_PRE_FRAMES + 2):
        before.add(record(number))
    assert before.short
    assert len(before.drain()) == MAX_PRE_FRAMES + 1
