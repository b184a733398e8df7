"""What is found in a log without a rule: a fault each, and none where all is well."""

from __future__ import annotations

import pytest

from tests.host.canmon.model.check.sound_log import FAULTS, Plan, faulty, sound
from tickrig.host.canmon.model.check import bus_frames
from tickrig.host.canmon.model.check.diagnosis import RULES, Diagnoser, diagnose
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame

PLANS = {
    "usual": Plan(),
    "guarded": Plan(guarded=True),
    "500 kbit/s": Plan(2, 6_000, 20, 500, 500_000),
    "fast": Plan(3, 5_000, 8, 250),
}


@pytest.fixture(params=[1 << 60, 0], ids=["lists", "numpy"])
def both_ways(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge frames in lists and in arrays of numpy."""
    monkeypatch.setattr(bus_frames, "_MANY", request.param)


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
def test_a_sound_log_has_no_finding(plan: Plan) -> None:
    found = diagnose([sound(plan)], plan.bit_rate)
    assert [str(fault) for fault in found.faults] == []
    known = {*found.judged, *found.unjudged}
    assert known == RULES.keys()
    assert ("guard-toggle" in found.unjudged) is not plan.guarded


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_found_without_a_rule(name: str, plan: Plan) -> None:
    rule, node, _ = FAULTS[name]
    found = [(one.rule, one.node) for one in diagnose([faulty(name, plan)], plan.bit_rate).faults]
    assert (rule, node) in found
    # A node that does not stop when NMT stops it is another fault.
    assert set(found) <= {(rule, node), ("nmt-state", node)}


@pytest.mark.parametrize("begin", [1, 200, 800])
def test_a_log_may_begin_in_the_middle(begin: int) -> None:
    assert diagnose([sound()[begin:]]).faults == ()


@pytest.mark.parametrize("end", [300, 900, -1])
def test_a_log_may_end_in_the_middle(end: int) -> None:
    assert diagnose([sound()[:end]]).faults == ()


def test_buses_are_judged_by_themselves() -> None:
    other = [one._replace(channel="can1") for one in faulty("PDO missing", PLANS["fast"])]
    both = sorted([*sound(), *other], key=lambda record: record.at_us)
    (fault,) = diagnose([both]).faults
    assert (fault.rule, fault.channel) == ("pdo-missing", "can1")
    shown = [both[place.number - 1] for place in fault.frames]
    assert {(one.channel, str(one.frame)[:3]) for one in shown} == {("can1", "185")}


def test_what_came_is_judged_again_and_again() -> None:
    one = Diagnoser()
    records = faulty("NMT stop")
    one.take(records[:1_000])
    assert one.diagnosis().faults == ()
    one.take(records[1_000:])
    assert [fault.rule for fault in one.diagnosis().faults] == ["nmt-stop"]


def test_a_heartbeat_that_is_left_out_is_found() -> None:
    beats = [Record(at * 100_000, "can0", CanFrame.parse("705#05")) for at in range(20)]
    (fault,) = diagnose([beats[:9], beats[10:]]).faults
    assert (fault.rule, fault.node, fault.first_us, fault.last_us) == (
        *("no-lost-heartbeat", 5),
        *(800_000, 1_000_000),
    )
    assert [place.number for place in fault.frames] == [9, 10]


def lines(text: str, step_us: int = 1_000) -> list[Record]:
    """Return frames, one each millisecond."""
    return [
        Record(at * step_us, "can0", CanFrame.parse(frame)) for at, frame in enumerate(text.split())
    ]


def test_without_times_nothing_is_judged_by_them() -> None:
    found = diagnose([lines("701#00 704#00 701#7F 701#7F 704#00 180#R 081#0050010000000000", 0)])
    assert [fault.rule for fault in found.faults] == ["no-emcy", "no-reboot"]
    assert found.unjudged["pdo-missing"] == found.unjudged["time-back"]
    assert "no-lost-heartbeat" in found.unjudged


def test_an_emcy_before_the_first_boot_up_is_no_sign_of_life() -> None:
    (fault,) = diagnose([lines("081#0050010000000000 701#00 701#7F 701#7F")]).faults
    assert fault.rule == "no-emcy"
