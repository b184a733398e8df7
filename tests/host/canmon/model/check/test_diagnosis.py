"""What is found in a log without a rule: a fault each, and none where all is well."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.check.sound_log import (
    FAULTS,
    Plan,
    faulty,
    frame_of,
    places,
    put,
    sound,
    without,
)
from tickrig.host.canmon.model.check import bus_frames, cycles, learnt
from tickrig.host.canmon.model.check.diagnosis import RULES, Diagnoser, Diagnosis
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame


def diagnose(blocks: Iterable[Sequence[Record]], bit_rate: int | None = None) -> Diagnosis:
    """Judge the frames of a log."""
    one = Diagnoser(bit_rate)
    for block in blocks:
        one.take(block)
    return one.diagnosis()


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
    assert {*found.judged, *found.unjudged} == RULES.keys() - learnt.RULES.keys()
    assert {rule for rule, _, _ in FAULTS.values()} - {"guard-toggle"} <= set(found.judged)
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


GAPS = st.one_of(
    st.just([10_000] * 8),
    st.just([10_000] * 200),
    st.just([12_500] * 16),
    st.lists(st.integers(9_700, 10_300), min_size=1, max_size=20),
    st.lists(st.integers(0, 25_000), max_size=12),
    st.sampled_from([[20_000], [5_000, 5_000], [14_000, 6_000], [100]]),
    st.lists(st.sampled_from([3_000, 10_000, 17_000]), min_size=8, max_size=40),
)


@pytest.mark.parametrize("few", [1, 64])
@given(parts=st.lists(GAPS, max_size=30))
def test_a_rhythm_is_the_same_in_lists_and_in_arrays(few: int, parts: list[list[int]]) -> None:
    times = np.cumsum([0, *(gap for part in parts for gap in part)])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cycles, "_FEW_RUNS", few)
        patch.setattr(cycles, "_LEAST_AT_ONCE", 2)
        assert cycles.rhythm_of(times) == cycles.rhythm_of(times.tolist())  # type: ignore[arg-type]


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


# A node that loses its power, and a node that is reset.

BEGIN_US, BACK_US = 1_645_000, 2_345_000


def outage(*nodes: int, between: Sequence[tuple[int, str]] = ()) -> list[Record]:
    """Return a sound log in which nodes send nothing for 0.7 s, and boot then."""
    idents = {base + node for node in nodes for base in (0x180, 0x580, 0x600, 0x700)}
    left = [
        one
        for one in sound()
        if not BEGIN_US <= one.at_us < BACK_US or frame_of(one).can_id not in idents
    ]
    for at_us, text in between:
        left = put(left, at_us, text)
    return put(left, BACK_US, *(f"7{node:02X}#00" for node in nodes))


def found_in(records: list[Record]) -> dict[tuple[str, int | None], str]:
    """Return the findings by rule and node."""
    return {(one.rule, one.node): one.text for one in diagnose([records]).faults}


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("between", [[], [(1_800_000, "000#8110"), (1_900_000, "000#0105")]])
def test_a_node_that_boots_by_itself_was_lost_before(between: list[tuple[int, str]]) -> None:
    found = found_in(outage(5, between=between))
    assert found.keys() == {(rule, 5) for rule in ("no-lost-heartbeat", "pdo-missing", "no-reboot")}
    assert found["no-lost-heartbeat", 5].startswith("no heartbeat for 7")
    last = "2" if between else "7"
    assert found["pdo-missing", 5].startswith(f"TPDO1 (185) does not come for {last}")
    assert found["no-reboot", 5].startswith("boots again without an NMT reset, silent for 7")


@pytest.mark.usefixtures("both_ways")
@pytest.mark.parametrize("reset", [(1_645_000, "000#8105"), (1_646_000, "000#8200")])
def test_a_node_that_is_reset_was_not_lost(reset: tuple[int, str]) -> None:
    assert found_in(outage(5, between=[reset])) == {}


@pytest.mark.usefixtures("both_ways")
def test_a_node_that_is_reset_because_it_is_silent_was_lost() -> None:
    found = found_in(outage(5, between=[(2_245_000, "000#8105")]))
    assert found.keys() == {("no-lost-heartbeat", 5)}
    assert found["no-lost-heartbeat", 5].startswith("no heartbeat for 6")


@pytest.mark.usefixtures("both_ways")
def test_a_node_that_is_silent_before_its_1017h_is_written_was_lost() -> None:
    records = outage(17)
    records = without(records, *places(records, 0x711, "00")[1:])
    records = put(records, BACK_US, "611#2B17100064000000", "591#6017100000000000")
    assert found_in(records).keys() == {("no-lost-heartbeat", 17)}


@pytest.mark.usefixtures("both_ways")
def test_a_bus_that_is_switched_off_and_on_is_silent_once() -> None:
    records = [one for one in sound() if not BEGIN_US <= one.at_us < BACK_US]
    records = put(records, BACK_US, *(f"7{node:02X}#00" for node in (5, 6, 16, 17)))
    found = found_in(records)
    assert found.keys() == {("silence", None), *(("no-reboot", node) for node in (5, 6, 16, 17))}
    assert "where 7 CAN-IDs should come" in found["silence", None]


def test_a_node_that_is_switched_on_later_was_not_lost() -> None:
    assert found_in([one for one in outage(5) if not is_of(one, 5) or one.at_us >= BACK_US]) == {}


def test_a_period_that_only_an_eds_gives_finds_no_silence_before_1017h_is_written() -> None:
    one = Diagnoser(eds={5: EdsObjects(values={(0x1017, 0): b"\x64\0"})})
    node = "705#05 605#2B171000C4090000 585#6017100000000000 705#05"
    records = lines("706#05 " * 8, 1_000_000) + lines(node, 2_500_000)
    one.take(sorted(records, key=lambda record: record.at_us))
    assert one.diagnosis().faults == ()


def is_of(record: Record, node: int) -> bool:
    """Return whether a frame is of a node."""
    return frame_of(record).can_id in {base + node for base in (0x080, 0x180, 0x580, 0x600, 0x700)}


def test_a_reset_of_all_excuses_a_node_that_sent_only_pdos() -> None:
    found = found_in(lines("185#00 185#00 706#05 000#8100 705#00 706#00 705#05 706#05"))
    assert found == {}


def test_a_boot_up_that_is_usual_stays_usual() -> None:
    one = Diagnoser()
    one.take(faulty("boot-up"))
    rules = learnt.parse_learnt(learnt.learnt_text(one.summaries(), []))
    assert rules is not None
    assert rules["can0"].usual == {"no-reboot: node 17: boots again without an NMT reset"}
    other = Diagnoser(rules=rules)
    other.take(put(list(sound()), 2_060_000, "711#00"))
    assert other.diagnosis().faults == ()


def lines(text: str, step_us: int = 1_000) -> list[Record]:
    """Return frames, one each millisecond."""
    return [
        Record(at * step_us, "can0", CanFrame.parse(frame)) for at, frame in enumerate(text.split())
    ]


def test_without_times_nothing_is_judged_by_them() -> None:
    found = diagnose([lines("701#00 704#00 701#7F 701#7F 704#00 180#R 081#0050010000000000", 0)])
    assert [fault.rule for fault in found.faults] == ["no-reboot", "no-emcy"]
    assert found.unjudged["pdo-missing"] == found.unjudged["time-back"]
    assert "no-lost-heartbeat" in found.unjudged


def test_a_node_that_boots_and_sends_no_heartbeat_any_more_is_one_finding() -> None:
    beats = lines("701#7F " * 10 + "080#", 100_000)
    after = [record._replace(at_us=1_700_000) for record in lines("701#00")]
    end = [record._replace(at_us=3_000_000) for record in lines("080#")]
    found = diagnose([beats + after + end])
    (fault,) = [fault for fault in found.faults if fault.rule == "no-lost-heartbeat"]
    said, _, boot = fault.text.partition("; ")
    assert said == "no heartbeat for 2100.0 ms, one each 100.000 before"
    assert boot == "boot-up after 800.000 ms, none since then"


@pytest.mark.parametrize(("step_us", "judged"), [(99_999, False), (100_000, True)])
def test_the_load_of_a_short_log_is_not_judged(step_us: int, judged: bool) -> None:
    found = diagnose([lines("701#00 701#7F 701#7F 701#7F 701#7F 701#7F", step_us)], 125_000)
    assert ("max-load" in found.judged) is judged
    assert judged or found.unjudged["max-load"] == "the traffic lasts less than 0.5 s"


def test_an_emcy_before_the_first_boot_up_is_no_sign_of_life() -> None:
    (fault,) = diagnose([lines("081#0050010000000000 701#00 701#7F 701#7F")]).faults
    assert fault.rule == "no-emcy"


# Sources that are not exact: stamps and masters with jitter, frames that are late, events.


def noisy(seed: int, length_us: int, jitter_us: int = 200, late: float = 0.002) -> list[Record]:
    """Return traffic of two nodes and a master that keep no time exactly."""
    chance, texts = Random(seed), list[tuple[float, str]]()
    texts += [(1_000.0, "701#00"), (1_900.0, "702#00"), (300_000.0, "000#0100")]
    for node in (1, 2):
        begin_us = chance.randrange(50_000, 250_000)
        for at in range(begin_us, length_us, 200_000):
            state = "7F" if at < 300_000 else "05"
            texts.append((at + chance.gauss(0, jitter_us), f"70{node}#{state}"))
    for cycle, at in enumerate(range(400_000, length_us, 10_000)):
        at_us = at + chance.gauss(0, jitter_us) + 6_000 * chance.random() * (chance.random() < late)
        texts.append((at_us, "080#"))
        for node in (1, 2):
            off_us = 300 + 130 * node + abs(chance.gauss(0, 30))
            texts.append((at_us + off_us, f"18{node}#3706{cycle:04X}0000"))
            texts.append((at_us + 1_500 + 130 * node, f"20{node}#0F00{cycle:04X}0000"))
    event_us = 400_000.0
    while event_us < length_us:  # an event timer of 100 ms, and events
        texts.append((event_us, f"482#{chance.randrange(256):02X}00"))
        event_us += 100_000 if chance.random() < 0.7 else chance.randrange(5_000, 100_000)
    return [Record(int(at_us), "can0", CanFrame.parse(text)) for at_us, text in sorted(texts)]


@pytest.mark.parametrize("seed", range(8))
def test_sources_that_are_not_exact_have_no_finding(seed: int) -> None:
    chance = Random(seed)
    jitter_us, late = chance.choice([0, 200, 500]), chance.choice([0, 0.002, 0.02])
    records = noisy(seed, chance.choice([3, 8]) * 1_000_000, jitter_us, late)
    assert [str(fault) for fault in diagnose([records]).faults] == []
    assert [str(fault) for fault in diagnose([records[len(records) // 3 :]]).faults] == []


@pytest.mark.parametrize(("rule", "can_id"), [("pdo-missing", 0x181), ("sync-missing", 0x080)])
def test_a_frame_that_an_inexact_source_leaves_out_is_found(rule: str, can_id: int) -> None:
    records = noisy(3, 6_000_000)
    gone = places(records, can_id)[300]
    (fault,) = diagnose([without(records, gone)]).faults
    assert (fault.rule, fault.amount) == (rule, 1)
    before, behind = fault.frames
    assert before.number <= gone < behind.number


@pytest.mark.parametrize(
    "text",
    [
        # Cars and trucks use the CAN-IDs of CANopen for other things.
        "701#0102030405060708 080#1122334455667788 581#0102030405060708 181#01 0F1#1C0500",
        "18FEF100#FFFFFFFFFFFFFFFF 0CF00400#0102030405060708 18EAFFFE#00EE00",
        "7DF#02010C0000000000 7E8#04410C0B54000000 7E0#0322F19000000000 7E8#037F227800000000",
    ],
)
def test_what_is_no_canopen_is_not_judged_as_if_it_were(text: str) -> None:
    records = lines(" ".join([text] * 40))
    found = diagnose([[*records[:70], *records[75:]]])
    assert found.faults == ()
    assert set(found.judged) == {"no-error-frames", "no-loss", "time-back"}
    assert found.unjudged["pdo-missing"] == "no CANopen traffic was found"


# What is learnt from a good log.


@cache
def rules_of(plan: Plan) -> learnt.Learnt:
    """Learn the rules of a sound log, from what is written of them."""
    one = Diagnoser()
    one.take(sound(plan))
    rules = learnt.parse_learnt(learnt.learnt_text(one.summaries(), ["of a test"]))
    assert rules is not None
    return rules


def held(plan: Plan, records: list[Record]) -> set[str]:
    """Return the rules that a log breaks, with what was learnt from a good one."""
    one = Diagnoser(rules=rules_of(plan))
    one.take(records)
    return {fault.rule for fault in one.diagnosis().faults}


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
@pytest.mark.parametrize("seed", [7, 8])
def test_another_good_log_keeps_what_was_learnt(plan: Plan, seed: int) -> None:
    assert held(plan, list(sound(replace(plan, seed=seed, length_ms=3_400 + 150 * seed)))) == set()


@pytest.mark.parametrize("plan", list(PLANS.values())[:2], ids=list(PLANS)[:2])
@pytest.mark.parametrize("name", FAULTS)
def test_each_fault_breaks_what_was_learnt(name: str, plan: Plan) -> None:
    rule = FAULTS[name][0]
    assert ("learnt-load" if rule == "max-load" else rule) in held(plan, faulty(name, plan))


def test_what_differs_from_a_good_log_is_found() -> None:
    plan, records = PLANS["usual"], list(sound())
    node = 0x180 + 5, 0x700 + 5, 0x580 + 5
    gone = [one for one in records if frame_of(one).can_id not in node]
    assert {"learnt-nodes", "learnt-frames"} <= held(plan, gone)
    assert held(plan, put(records, 2_000_000, "1A3#00")) >= {"learnt-frames", "learnt-nodes"}
    assert held(plan, list(sound(replace(plan, sync_ms=20)))) == {"learnt-period"}
    assert held(plan, list(sound(replace(plan, heartbeat_ms=300)))) == {"learnt-period"}
    shorter = [
        one._replace(frame=CanFrame(0x185, bytes(4))) if frame_of(one).can_id == 0x185 else one
        for one in records
    ]
    assert "learnt-length" in held(plan, shorter)


def test_another_identity_and_order_of_boot_ups_is_found() -> None:
    good = lines("701#00 601#4018100100000000 581#4318100178563412 701#7F " * 1, 200_000)
    good += [one._replace(at_us=one.at_us + 800_000) for one in lines("702#00 702#7F", 200_000)]
    one = Diagnoser()
    one.take(good)
    rules = learnt.parse_learnt(learnt.learnt_text(one.summaries(), []))
    assert rules is not None
    assert rules["can0"].boot_order == ((1,), (2,))
    assert rules["can0"].nodes[1].identity[0] == 0x12345678
    other = Diagnoser(rules=rules)
    other.take(
        lines("702#00 702#7F 701#00 601#4018100100000000 581#4318100179563412 701#7F", 200_000)
    )
    faults = {fault.rule: fault for fault in other.diagnosis().faults}
    assert faults.keys() == {"learnt-identity", "learnt-order"}
    assert [place.number for place in faults["learnt-identity"].frames] == [5]


def test_the_load_of_a_short_log_is_learnt_by_its_own_time() -> None:
    for step_us, bits_s in ((10_000, 5_600), (1_000, 56_000)):  # 100 frames in 1 s, and in 0.1 s
        one = Diagnoser()
        one.take(lines(" ".join(["181#"] * 100), step_us))
        (bus,) = one.summaries()
        assert bits_s * 0.8 < bus.bits_per_second < bits_s * 1.1


def test_what_a_good_log_has_is_usual() -> None:
    usual = put(list(sound()), 2_030_000, "091#1023020000000000")
    one = Diagnoser()
    one.take(usual)
    rules = learnt.parse_learnt(learnt.learnt_text(one.summaries(), []))
    again = Diagnoser(rules=rules)
    again.take(put(list(sound()), 1_030_000, "091#1023020000000000"))
    assert again.diagnosis().faults == ()
    other = Diagnoser(rules=rules)
    other.take(put(list(sound()), 1_030_000, "091#2023020000000000"))
    assert [fault.rule for fault in other.diagnosis().faults] == ["no-emcy"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("learnt = 3", "learnt is not a table"),
        ("no_emcy = true\n[learnt.can0]", "'no_emcy' beside [learnt]"),
        ("[learnt.can0]\nboot_orders = []", "did you mean 'boot_order'?"),
        ("[learnt.can0.node.128]", "'128' is not a node-ID from 1 to 127"),
        ("[learnt.can0.frame.18]", "'18' is not a CAN-ID"),
        ('[learnt.can0.frame.181]\nperiod = "10"', "is not like 10ms±20%"),
        ('[learnt.can0.frame.181]\nkind = "often"', "is not one of cyclic, sync, event"),
        ("[learnt.can0.frame.181]\nlengths = [65]", "65 is not a whole number from 0 to 64"),
    ],
)
def test_what_is_wrong_in_learnt_rules_is_said(text: str, reason: str) -> None:
    with pytest.raises(ValueError, match="learnt") as caught:
        learnt.parse_learnt(text)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_bus_that_falls_silent_is_judged_until_now() -> None:
    one = Diagnoser()
    one.take([Record(at * 100_000, "can0", CanFrame.parse("705#05")) for at in range(20)])
    assert one.diagnosis().faults == ()
    (fault,) = one.diagnosis(end_us=5_000_000).faults
    assert str(fault) == (
        "no-lost-heartbeat: can0 node 5: no heartbeat for 3100.0 ms, one each 100.000 before"
    )


def test_a_finding_of_an_sdo_transfer_has_the_frame_that_shows_it() -> None:
    ask = "590#4108100009000000"
    cases = {
        "sdo-toggle": (
            "610#4008100000000000",
            ask,
            "610#6000000000000000",
            "*590#1B66000000000000",
        ),
        "no-sdo-abort": ("610#4008100000000000", ask, "*590#8008100000000206"),
        "sdo-unanswered": ("*610#4008100000000000",),
    }
    broken = ("610#4008100000000000", ask, "*610#6000000000000000")
    for rule, texts in (*cases.items(), ("sdo-unanswered", broken)):
        for behind in ("", "610#4000100000000000 590#4300100091010700"):
            frames = " ".join(("710#05 590#4300100091010700", *texts)).replace("*", "")
            found = diagnose([lines(f"{frames} {behind} {'710#05 ' * 30}", 100_000)]).faults
            (fault,) = (one for one in found if one.rule == rule)
            number = 3 + next(at for at, text in enumerate(texts) if text.startswith("*"))
            assert [place.number for place in fault.frames] == [number]
            assert fault.first_us == fault.frames[0].at_us


def test_what_is_not_as_learnt_shows_where() -> None:
    plan = Plan()
    records = list(sound(plan))
    shorter, second = faulty("PDO length", plan), faulty("doubled node-ID", plan)
    busy = faulty("load", plan)
    at = next(at for at, one in enumerate(second) if one not in records)
    third = [*records[:at], *second[at:]]
    chance = Random(1)
    jitter = [
        one._replace(at_us=one.at_us + chance.randrange(2_200) * (frame_of(one).can_id == 0x185))
        for one in records
    ]
    jitter.sort(key=lambda one: one.at_us)
    moved = next(at for at, (a, b) in enumerate(zip(jitter, records, strict=True)) if a != b)
    cases = {
        "learnt-length": (shorter, shorter.index(next(o for o in shorter if o not in records))),
        "learnt-period": (third, at),
        "learnt-jitter": (jitter, moved),
        "learnt-load": (busy, next(at for at, one in enumerate(busy) if one not in records)),
    }
    for rule, (log, culprit) in cases.items():
        one = Diagnoser(rules=rules_of(plan))
        one.take(log)
        faults = one.diagnosis().faults
        (fault,) = (fault for fault in faults if fault.rule == rule)
        near_us = log[culprit].at_us
        if rule == "learnt-load":
            assert fault.first_us <= near_us <= fault.last_us < near_us + 100_000
        else:
            assert near_us - 60_000 <= fault.first_us <= near_us + 60_000, rule
        assert [fault.first_us for fault in faults] == sorted(fault.first_us for fault in faults)
        if rule == "learnt-length":
            assert [place.number for place in fault.frames] == [culprit + 1]


def test_a_pdo_that_comes_once_at_the_start_is_no_finding() -> None:
    records = list(sound())
    start_us = next(one.at_us for one in records if str(one.frame) == "000#0100")
    for off_us, found in ((1_400_000, []), (1_600_000, ["seen-once"])):
        faults = diagnose([put(list(records), start_us + off_us, "391#01")]).faults
        assert [fault.rule for fault in faults] == found
