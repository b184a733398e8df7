from __future__ import annotations

import pytest

from tests.host.canmon.model.check.expression.held import MAPPED, broken, findings, unjudged
from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import FdFrame


def test_a_state_that_is_reached_in_time_is_right() -> None:
    rule = "node 3 operational within 2s"
    assert broken(rule, "1 703#00\n2 703#7F\n3 703#05") == []
    assert broken(rule, "1 703#00\n3.1 703#05") == ["3 no node 3 operational in 2000.0 ms"]
    assert broken(rule, "1 703#00\n1.1 704#05", end_s=9) == ["3 no node 3 operational in 2000.0 ms"]


def test_a_log_that_ends_before_the_time_is_over_breaks_no_limit() -> None:
    assert broken("heartbeat of 3 within 2s", "1 704#00\n2 704#05") == []


def test_a_limit_after_an_event_begins_with_each() -> None:
    rule = "node 3 operational within 1s after boot-up of 3"
    text = "1 703#00\n1.5 703#05\n5 703#00\n6.5 703#05"
    assert broken(rule, text) == [
        "6 boot-up of node 3: boot-up: no node 3 operational in 1000.0 ms"
    ]


def test_each_node_of_a_range_is_waited_for() -> None:
    assert broken("heartbeat of 3-5 within 1s", "1 703#05\n1.5 705#05\n3 703#05") == [
        "2 no heartbeat of 4 in 1000.0 ms"
    ]


EVERY = "tpdo1 of 3 every 10ms ±10%"


def test_a_period_is_kept_or_not() -> None:
    assert broken(EVERY, MAPPED + "1 183#\n1.009 183#\n1.02 183#") == []
    assert broken(EVERY, MAPPED + "1 183#\n1.008 183#\n1.0195 183#") == [
        "1.008 node 3: 8.000 ms after the one before, 9.000 to 11.000 is right",
        "1.0195 node 3: 11.500 ms after the one before, 9.000 to 11.000 is right",
    ]


@pytest.mark.parametrize("rule", ["every 10ms ± 1ms", "every 10ms +-10%", "every 9ms..11ms"])
def test_a_period_is_written_in_several_ways(rule: str) -> None:
    text = "1 703#05\n1.009 703#05\n1.02 703#05\n1.0289 703#05"
    assert [line[:7] for line in broken(f"heartbeat {rule}", text)] == ["1.0289 "]


def test_a_minimum_gap_has_no_upper_limit() -> None:
    text = MAPPED + "1 183#\n1.004 183#\n3 183#"
    assert broken("tpdo1 every 5ms..", text, end_s=9) == [
        "1.004 node 3: 4.000 ms after the one before, at least 5.000 is right"
    ]


def test_what_stops_or_never_comes_is_missed() -> None:
    rule = "heartbeat every ..20ms"
    assert broken(rule, "1 703#05\n1.01 704#05", end_s=1.025) == [
        "1.025 node 3: 25.000 ms without another, 0.000 to 20.000 is right"
    ]
    assert broken("heartbeat of 5 every ..20ms", "1 703#05") == ["1 heartbeat of 5 never came"]


def test_identifiers_have_their_periods_apart() -> None:
    text = "1 703#05\n1.005 704#05\n1.01 703#05\n1.015 704#05"
    assert broken("heartbeat every 10ms ±1ms", text) == []


OF_3 = "heartbeat of 3 every 10ms ±10%"
RESTART = "1.5 703#00\n1.9 703#7F\n1.91 703#7F"


@pytest.mark.parametrize("reset", ["0.9 000#8103", "1.015 000#8200", "1.4 000#8103"])
def test_the_gap_around_a_boot_up_after_a_reset_is_free(reset: str) -> None:
    frames = sorted(["1 703#05", "1.01 703#05", reset], key=lambda line: float(line.split()[0]))
    text = "\n".join(frames)
    assert broken(OF_3, f"{text}\n{RESTART}") == []
    lost = f"{text}\n{RESTART}\n2.5 703#00"
    assert [line[:3] for line in broken(OF_3, lost)] == ["2.5"]  # a reset excuses one boot-up


@pytest.mark.parametrize("other", ["000#8104", "000#0103", "000#8103R", "704#00", "000#81"])
def test_the_gap_before_a_boot_up_without_a_reset_counts(other: str) -> None:
    text = f"1 703#05\n1.01 703#05\n1.02 {other.removesuffix('R')}\n{RESTART}"
    text = text.replace("000#8103", "000#R")
    said = "without another before the boot-up, 9.000 to 11.000 is right"
    assert broken(OF_3, text) == [f"1.5 node 3: 490.000 ms {said}"]
    assert broken("heartbeat of 3 every 5ms..", text) == []
    assert broken("heartbeat of 4 every 10ms ±10%", f"0.9 704#05\n{text}\n1.92 705#00")[1:] == []


def test_the_gap_before_a_boot_up_is_that_of_each_identifier() -> None:
    text = MAPPED + "1 183#\n1.01 183#\n1.02 703#05\n1.2 703#00\n1.5 183#\n1.51 183#"
    said = "without another before the boot-up, 0.000 to 100.000 is right"
    assert broken("(tpdo1 or heartbeat) and node=3 every ..100ms", text) == [
        f"1.2 node 3: 190.000 ms {said}; node 3: 180.000 ms {said}",
    ]
    assert broken("tpdo1 of 3 every ..200ms", text) == []


@pytest.mark.parametrize("rule", ["183", "183-184", "183 or 184", "183, 182", "id=183"])
@pytest.mark.parametrize("before", ["000#8103", "704#05"])
def test_a_rule_about_can_ids_knows_no_boot_up(rule: str, before: str) -> None:
    text = f"1 183#\n1.01 183#\n1.02 {before}\n1.03 703#00\n1.2 183#"
    assert broken(f"{rule} every ..20ms", text) == [
        "1.2 node 3: 190.000 ms after the one before, 0.000 to 20.000 is right"
    ]
    assert broken(f"({rule}) and dlc=0 every ..20ms", text) == []


SYNC = "sync to tpdo1 of 3 under 2ms"


def test_an_answer_to_sync_that_is_late_or_missing_is_found() -> None:
    assert broken(SYNC, MAPPED + "1 080#\n1.002 183#") == []
    late = MAPPED + "1 080#\n1.003 183#\n2 080#\n2.001 183#\n3 080#"
    assert broken(SYNC, late, end_s=4) == [
        "1.002 sync: no tpdo1 of 3 in 2.000 ms",
        "3.002 sync: no tpdo1 of 3 in 2.000 ms",
    ]


def test_an_answer_to_the_second_sync_is_measured_from_the_first() -> None:
    text = MAPPED + "1 080#\n1.01 080#\n1.011 183#"
    assert broken("sync to tpdo1 of 3 under 20ms", text) == []
    assert broken("sync to tpdo1 of 3 under 10ms", text) == [
        "1.01 sync: no tpdo1 of 3 in 10.000 ms"
    ]


def test_a_finding_about_what_is_missing_shows_what_it_belongs_to() -> None:
    (found,) = findings(SYNC, hear(MAPPED + "1 080#\n2 704#05"))
    assert (found.at_us, str(found.record and found.record.frame)) == (1_002_000, "080#")


def test_events_without_a_node_belong_together_by_their_nodes() -> None:
    rule = "boot-up to heartbeat under 100ms"
    text = "1 703#00\n1.01 704#00\n1.05 704#7F\n2 704#7F"
    assert broken(rule, text) == ["1.1 boot-up of node 3: boot-up: no heartbeat in 100.000 ms"]


SDO = "sdo answered within 50ms"
ASKED = "603#4000100000000000"
ANSWER = "583#4300100092010200"


def test_an_sdo_request_that_is_answered_in_time_is_right() -> None:
    assert broken(SDO, f"1 {ASKED}\n1.05 {ANSWER}\n2 {ASKED}\n2.01 583#8000100000000206") == []


def test_an_sdo_request_without_an_answer_is_found() -> None:
    said = "sdo of node 3: upload of 1000h:00 asked for: not answered in 50.000 ms"
    assert broken(SDO, f"1 {ASKED}\n2 080#") == [f"1.05 {said}"]
    assert broken(SDO, f"1 {ASKED}\n1.1 {ANSWER}") == [f"1.05 {said}"]
    assert broken("sdo[1001h] answered within 50ms", f"1 {ASKED}\n2 080#") == []


def test_each_segment_is_answered_and_an_abort_is_not() -> None:
    segmented = "1 603#4008100000000000\n1.01 583#4108100009000000\n1.02 603#6000000000000000"
    assert [line[:4] for line in broken(SDO, segmented, end_s=2)] == ["1.07"]
    assert broken(SDO, f"1 {ASKED}\n1.01 603#8000100000000405", end_s=2) == []


def test_a_block_is_answered_behind_its_last_segment() -> None:
    begun = "1 603#C2501F010E000000\n1.01 583#A0501F0102000000\n"
    first = "1.02 603#0100010203040506\n"
    assert broken(SDO, begun + first, end_s=2) == []
    second = "1.03 603#0200010203040506\n"
    assert [line[:4] for line in broken(SDO, begun + first + second, end_s=2)] == ["1.08"]
    confirmed = "1.04 583#A202020000000000\n"
    assert broken(SDO, begun + first + second + confirmed, end_s=2) == []


def test_guarding_is_answered() -> None:
    rule = "guard answered within 20ms"
    assert broken(rule, "1 703#R\n1.01 703#05\n2 703#R\n2.03 703#85") == [
        "2.02 guard of node 3: guarding request: not answered in 20.000 ms"
    ]


def test_frames_of_can_fd_have_their_periods_apart() -> None:
    frames = [(1_000, "181##1AA"), (1_005, "182##1AA"), (1_010, "181##1AA"), (1_015, "182##1AA")]
    records = [Record(at * 1_000, "can0", FdFrame.parse(text)) for at, text in frames]
    assert findings("id >= 181 every 10ms ±1ms", records) == []
    assert len(findings("id >= 181 every 5ms ±1ms", records)) == 2


def test_a_request_that_is_sent_again_is_measured_from_the_first() -> None:
    again = "\n".join(f"{1 + n / 25} {ASKED}" for n in range(4))
    assert [line[:5] for line in broken(SDO, f"{again}\n2 080#")] == ["1.05 ", "1.13 "]


def test_another_request_tells_that_the_one_before_was_not_answered() -> None:
    text = f"1 {ASKED}\n1.02 603#4001100000000000\n1.03 583#4F01100000000000"
    assert broken(SDO, text) == [
        "1.02 sdo of node 3: upload of 1000h:00 asked for: not answered before the next request"
    ]


def test_what_no_node_sends_belongs_to_the_frames_of_any() -> None:
    assert broken("sync to heartbeat under 10ms", "1 080#\n1.005 703#05\n2 080#\n2.02 703#05") == [
        "2.01 sync: no heartbeat in 10.000 ms"
    ]


def test_nodes_that_are_named_belong_together() -> None:
    rule = "node=3 and boot-up to node=4 and heartbeat under 100ms"
    assert broken(rule, "1 703#00\n1.05 704#05\n2 703#05") == []


def test_nothing_is_waited_for_when_its_scope_is_over() -> None:
    rule = "sync to tpdo1 of 3 under 2ms while node 3 operational"
    assert (
        broken(rule, MAPPED + "1 703#05\n1.1 080#\n1.101 703#04\n2 080#\n3 703#05\n4 703#05") == []
    )


BEATS = "1 703#05\n1.1 703#05\n1.2 703#05"


@pytest.mark.parametrize(
    ("rule", "text", "why"),
    [
        ("emcy never after boot-up of 3", BEATS, "it was never in force: after boot-up of 3"),
        ("emcy never while node 3 stopped", BEATS, "it was never in force: while node 3 stopped"),
        ("emcy never after boot-up of 3", "1 703#00", "it was never in force: after boot-up of 3"),
        ("heartbeat of 3 every ..20ms", "1 703#05", "heartbeat of 3 did not come twice from one"),
        ("tpdo1 of 3 every 5ms..", BEATS, "tpdo1 of 3 did not come twice from one sender"),
        ("node 3 operational within 2s", "1 703#7F\n2 703#7F", "it ends before 2000.0 ms have"),
        ("sync to tpdo1 of 3 under 2ms", BEATS, "no sync came that has 2.000 ms behind it"),
        ("sync to emcy under 2ms", "1 703#05\n2 080#", "no sync came that has 2.000 ms behind it"),
        ("sdo answered within 50ms", BEATS, "no request of sdo came that has 50.000 ms behind it"),
        ("guard answered within 50ms", BEATS, "no request of guard came"),
        ("emcy in {8130h}", BEATS, "no value of emcy came while it was in force"),
        ("sync counts", "1 080#01\n2 703#05", "no two values of sync came from one sender"),
        ("sync counts", "1 080#\n2 080#", "no two values of sync came from one sender"),
        ("sync steps under 5", "1 080#01", "no two values of sync came from one sender"),
        ("sync changes within 1s", "1 080#01", "no two values of sync came from one sender"),
        (
            "tpdo1 dlc",
            "1 183#00",
            "no frame of tpdo1 came whose length is known; PDOs without a known",
        ),
        ("emcy dlc", BEATS, "no frame of emcy came whose length is known"),
        ("guard toggle", "1 703#R\n1.01 703#05", "no two answers of guard to guarding came"),
        ("heartbeat every ..20ms", "1 703#05\n1 703#05", "all frames have one time"),
        ("heartbeat at most 9 per 1s", "1 703#05\n1 703#05", "all frames have one time"),
    ],
)
def test_a_rule_that_judges_nothing_says_why(rule: str, text: str, why: str) -> None:
    assert unjudged(rule, text).startswith(why)


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        ("emcy never", BEATS),
        ("emcy of 4 never", BEATS),
        ("emcy never after heartbeat of 3", BEATS),
        ("emcy at most 3", BEATS),
        ("emcy at most 3 per 1s", BEATS),
        ("boot-up at least 0", BEATS),
        ("heartbeat of 3 every 100ms ±10%", BEATS),
        ("node 3 operational within 2s", BEATS),
        ("sync to heartbeat under 2ms", "1 080#\n1.001 703#05"),
        ("heartbeat of 3 in {operational}", BEATS),
        ("heartbeat in {5}", BEATS),
        ("sync counts", "1 080#01\n2 080#02"),
        ("sync steps under 5", "1 080#01\n2 080#02"),
        ("sync changes within 1s", "1 080#01\n1.5 080#02"),
        ("dlc", BEATS),
        ("guard toggle", "1 703#R\n1.01 703#05\n2 703#R\n2.01 703#85"),
        ("guard answered within 50ms", "1 703#R\n1.01 703#05"),
    ],
)
def test_a_rule_that_judges_something_does_not(rule: str, text: str) -> None:
    assert unjudged(rule, text) == ""
