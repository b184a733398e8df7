"""Each rule against few frames."""

from __future__ import annotations

import pytest

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.check.checker import Checker
from tickrig.host.canmon.model.check.rules import Rules, parse_rules


def broken(
    rules: Rules, text: str, end_s: float | None = None, bit_rate: int | None = None
) -> list[str]:
    """Return what is found, as text with the time in seconds before it."""
    checker, records = Checker(rules, bit_rate), hear(text)
    found = [finding for record in records for finding in checker.take(record)]
    found += checker.end(round(end_s * 1e6) if end_s else records[-1].at_us)
    return [f"{finding.at_us / 1e6:g} {finding.text}" for finding in found]


def test_an_emcy_is_found_and_its_end_is_not() -> None:
    rules = Rules(no_emcy=True)
    assert broken(rules, "1 083#3081110000000000\n2 083#0000000000000000") == [
        "1 node 3: EMCY 8130h life guard error or heartbeat error"
    ]


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        ("083#3081", "8130h life guard error or heartbeat error (2 B, 8 are right)"),
        ("083#308111", "8130h life guard error or heartbeat error (3 B, 8 are right)"),
        ("083#30810000000000", "8130h life guard error or heartbeat error (7 B, 8 are right)"),
    ],
)
def test_an_emcy_that_is_cut_short_is_one(frame: str, said: str) -> None:
    assert broken(Rules(no_emcy=True), f"1 {frame}") == [f"1 node 3: EMCY {said}"]


def test_frames_of_emcy_without_an_error_code_are_noted() -> None:
    checker = Checker(Rules(no_emcy=True))
    assert [one for record in hear("1 083#\n2 083#30") for one in checker.take(record)] == []
    assert checker.unjudged(0).notes == ("no-emcy: 2 frames of EMCY without a whole error code",)


@pytest.mark.parametrize("frame", ["083#", "083#30", "083#0000", "080#3081110000000000", "083#R8"])
def test_what_is_no_emcy_is_not_found(frame: str) -> None:
    assert broken(Rules(no_emcy=True), f"1 {frame}") == []


def test_aborts_of_both_sides_are_found() -> None:
    text = "1 583#8040600000000206\n2 603#8040600000000405"
    assert broken(Rules(no_sdo_abort=True), text) == [
        "1 node 3: server aborts 6040h:00, object does not exist (06020000h)",
        "2 node 3: client aborts 6040h:00, SDO protocol timed out (05040000h)",
    ]


def test_an_abort_that_names_no_object_is_found() -> None:
    assert broken(Rules(no_sdo_abort=True), "1 603#8000000000000405") == [
        "1 node 3: client aborts its transfer, SDO protocol timed out (05040000h)"
    ]


def test_other_sdo_frames_are_not_found() -> None:
    assert broken(Rules(no_sdo_abort=True), "1 583#6040600000000000\n2 583#80") == []


def test_an_abort_that_is_cut_short_is_one() -> None:
    assert broken(Rules(no_sdo_abort=True), "1 583#80406000\n2 603#8040600000") == [
        "1 node 3: server aborts 6040h:00, without a whole abort code (4 B, 8 are right)",
        "2 node 3: client aborts 6040h:00, without a whole abort code (5 B, 8 are right)",
    ]


def test_error_frames_are_found() -> None:
    assert broken(Rules(no_error_frames=True), "1 20000020#0000000000000000") == [
        "1 no acknowledge"
    ]


def test_each_unknown_identifier_is_found_once() -> None:
    rules = parse_rules({"known": "181,280-282"})
    text = "1 181#\n2 281#\n3 183#\n4 183#\n5 00000181#\n6 20000020#0000000000000000"
    assert broken(rules, text) == ["3 183 is not expected", "5 00000181 is not expected"]


def test_a_known_identifier_stands_for_its_remote_frames_too() -> None:
    text = "1 714#R\n1 714#05\n2 715#R\n3 716#"
    assert broken(parse_rules({"known": "714,715R"}), text) == ["3 716 is not expected"]
    assert broken(parse_rules({"known": "714-716"}), text) == []
    assert broken(parse_rules({"known": "715R"}), "1 715#05") == ["1 715 is not expected"]


HEARTBEAT = parse_rules({"heartbeat": "3=100ms±20%"})


def test_heartbeats_in_time_are_right() -> None:
    assert broken(HEARTBEAT, "1 703#05\n1.08 703#05\n1.2 703#7F") == []


def test_a_late_and_an_early_heartbeat_are_found() -> None:
    assert broken(HEARTBEAT, "1 703#05\n1.13 703#05\n1.2 703#05") == [
        "1.13 node 3: 130.000 ms since its last heartbeat, at most 120.000 is right",
        "1.2 node 3: 70.000 ms since its last heartbeat, at least 80.000 is right",
    ]


@pytest.mark.parametrize("reset", ["0.9 000#8103\n1 703#05", "1 703#05\n1.1 000#8200"])
def test_the_times_around_a_boot_up_after_a_reset_are_free(reset: str) -> None:
    assert broken(HEARTBEAT, f"{reset}\n1.5 703#00\n1.9 703#7F\n2.0 703#7F") == []


@pytest.mark.parametrize("other", ["1.1 000#8104\n", "1.1 000#0103\n", "1.1 000#81\n", ""])
def test_the_time_before_a_boot_up_without_a_reset_counts(other: str) -> None:
    assert broken(HEARTBEAT, f"1 703#05\n{other}1.5 703#00\n1.9 703#7F\n2.0 703#7F") == [
        "1.5 node 3: 500.000 ms since its last heartbeat, at most 120.000 is right"
    ]
    assert broken(HEARTBEAT, f"1 703#05\n{other}1.12 703#00\n1.9 703#00\n2.0 703#00") == []


def test_the_time_before_a_reset_counts() -> None:
    text = "1 703#05\n1.3 000#8103\n1.4 000#8103\n1.5 703#00\n1.6 703#05"
    assert broken(HEARTBEAT, text) == [
        "1.5 node 3: 300.000 ms since its last heartbeat, at most 120.000 is right"
    ]
    said = "can0 node 3: no heartbeat for 300.000 ms, one each 100.000 ms before"
    assert broken(LOST, f"0.8 703#05\n0.9 703#05\n{text}") == [f"1.5 {said}"]


def test_a_node_that_resets_itself_loses_its_heartbeats() -> None:
    beats, boot = "0.8 703#05\n0.9 703#05\n1 703#05\n", "1.5 703#00\n2.5 703#05"
    said = "1.5 can0 node 3: no heartbeat for 500.000 ms, one each 100.000 ms before"
    assert broken(LOST, beats + boot) == [said]
    assert broken(LOST, f"{beats}1.1 000#8104\n1.2 000#0103\n{boot}") == [said]
    assert broken(LOST, f"{beats}1.1 000#8200\n{boot}") == []
    assert broken(LOST, f"0.7 000#8103\n{beats}{boot}") == []
    assert broken(LOST, beats + boot.replace("1.5", "1.15")) == []


def test_a_silence_before_1017h_is_written_counts() -> None:
    text = f"0.3 703#05\n0.4 703#05\n0.5 703#05\n1 {WRITE_1017}\n1.1 703#05"
    assert broken(LOST, text) == [
        "1.01 can0 node 3: no heartbeat for 510.000 ms, one each 100.000 ms before"
    ]


def test_a_heartbeat_without_a_state_is_found() -> None:
    assert broken(HEARTBEAT, "1 703#05\n1.1 703#") == ["1.1 node 3: heartbeat of 0 B, 1 is right"]


def test_a_boot_up_may_be_longer_than_its_byte() -> None:
    assert broken(Rules(no_reboot=True), "1 703#05\n2 703#0000000000000000") == [
        "2 node 3 boots again without an NMT reset"
    ]


def test_the_second_heartbeat_after_a_boot_up_is_judged() -> None:
    text = "1 703#00\n1.9 703#7F\n2.5 703#7F"
    assert [line[:3] for line in broken(HEARTBEAT, text)] == ["2.5"]


def test_a_heartbeat_that_stops_or_never_comes_is_found() -> None:
    assert broken(HEARTBEAT, "1 703#05", end_s=1.5) == [
        "1.5 node 3: 500.000 ms since its last heartbeat, at most 120.000 is right"
    ]
    assert broken(HEARTBEAT, "1 181#") == ["1 no heartbeat of node 3 came"]


def test_a_long_gap_is_found_and_one_that_lasts() -> None:
    rules = parse_rules({"max_gap": "181=20ms"})
    assert broken(rules, "1 181#\n1.02 181#\n1.05 181#", end_s=1.1) == [
        "1.05 30.000 ms without 181, at most 20.000 is right",
        "1.1 50.000 ms without 181, at most 20.000 is right",
    ]
    assert broken(rules, "1 182#") == ["1 181 never came"]


def test_gaps_are_those_of_one_bus() -> None:
    checker = Checker(parse_rules({"max_gap": "181=20ms"}))
    records = sorted(hear("1 181#\n1.02 181#", "can0") + hear("1.01 181#\n1.1 181#", "can1"))
    found = [finding for record in records for finding in checker.take(record)]
    assert [(finding.at_us, finding.record and finding.record.channel) for finding in found] == [
        (1_100_000, "can1")
    ]


def test_nodes_that_were_never_heard_are_found() -> None:
    rules = parse_rules({"nodes": "3,5-6"})
    assert broken(rules, "1 705#7F") == ["1 node 3 was never seen", "1 node 6 was never seen"]


@pytest.mark.parametrize("can_id", ["083", "183", "283", "383", "483", "583", "703"])
def test_a_node_was_heard_by_whatever_it_sent(can_id: str) -> None:
    assert broken(parse_rules({"nodes": 3}), f"1 {can_id}#80") == []
    boots = f"1 {can_id}#80\n2 703#00"
    assert broken(Rules(no_reboot=True), boots) == ["2 node 3 boots again without an NMT reset"]


@pytest.mark.parametrize("frame", ["000#0103", "080#", "203#00", "603#40", "703#R", "00000183#"])
def test_what_others_send_to_a_node_is_not_the_node(frame: str) -> None:
    assert broken(parse_rules({"nodes": 3}), f"1 {frame}") == ["1 node 3 was never seen"]
    assert broken(Rules(no_reboot=True), f"1 {frame}\n2 703#00") == []


def test_a_node_of_another_bus_is_another_node() -> None:
    checker = Checker(Rules(no_reboot=True))
    records = hear("1 183#", "can0") + hear("2 703#00", "can1")
    assert [finding for record in records for finding in checker.take(record)] == []


@pytest.mark.parametrize("command", ["8103", "8200"])
def test_a_boot_after_a_reset_is_right(command: str) -> None:
    assert broken(Rules(no_reboot=True), f"1 703#00\n2 703#05\n3 000#{command}\n4 703#00") == []


@pytest.mark.parametrize("command", ["000#8104", "000#0103", "000#81"])
def test_a_boot_without_a_reset_is_found(command: str) -> None:
    text = f"1 703#00\n2 703#05\n3 {command}\n4 703#00"
    assert broken(Rules(no_reboot=True), text) == ["4 node 3 boots again without an NMT reset"]


def test_a_reset_excuses_one_boot() -> None:
    text = "1 703#00\n2 000#8103\n3 703#00\n4 703#00"
    assert [line[0] for line in broken(Rules(no_reboot=True), text)] == ["4"]


LOST = Rules(no_lost_heartbeat=True)


def test_a_heartbeat_that_is_lost_is_found_without_a_period() -> None:
    text = "1.0 703#00\n1.2 703#7F\n1.3 703#05\n1.4 703#05\n1.55 703#05\n1.71 703#05"
    assert broken(LOST, text, end_s=1.86) == [
        "1.71 can0 node 3: no heartbeat for 160.000 ms, one each 100.000 ms before"
    ]
    assert broken(LOST, text, end_s=1.97)[1:] == [
        "1.97 can0 node 3: no heartbeat for 260.000 ms, one each 150.000 ms before"
    ]


@pytest.mark.parametrize(
    "text",
    [
        "1.0 703#00\n1.1 703#05\n1.2 703#05\n9.0 703#05",  # a period is not known yet
        "1.0 703#05\n1.1 703#05\n1.2 703#05\n1.3 703#00\n9.0 703#05",  # it boots meanwhile
        "1.0 703#05\n1.1 703#85\n1.2 703#05\n1.3 703#85\n9.0 703#05",  # it is guarded
        "1.0 703#05\n1.0 703#05\n1.0 703#05\n9.0 703#05",  # a log with one time for all
    ],
)
def test_what_is_no_lost_heartbeat_is_not_found(text: str) -> None:
    assert broken(LOST, text) == []


WRITE_1017 = "603#2B17100064000000\n1.01 583#6017100000000000"


@pytest.mark.parametrize(
    ("text", "end_s", "said"),
    [
        ("1 703#05\n1.1 703#05", 1.26, "160.000 ms, one each 100.000 ms before"),
        (f"0.5 703#05\n1 {WRITE_1017}\n1.1 703#05", 1.26, "160.000 ms, its 1017h says 100.000 ms"),
        (f"1 {WRITE_1017}", 1.2, "190.000 ms, its 1017h says 100.000 ms"),
        ("1 603#4017100000000000\n1.01 583#4B17100064000000\n1.1 703#00", 1.26, "160.000 ms, its"),
        (f"1 {WRITE_1017}\n1.1 703#05\n1.2 703#05\n1.36 703#05", 1.36, "160.000 ms, its 1017h"),
    ],
)
def test_a_dead_node_whose_period_can_be_known_is_found(text: str, end_s: float, said: str) -> None:
    (found,) = broken(LOST, text, end_s)
    assert f"can0 node 3: no heartbeat for {said}" in found
    assert broken(LOST, text if "1.36" not in text else f"1 {WRITE_1017}", 1.1) == []


def test_a_period_that_is_written_begins_anew_and_0_ends_it() -> None:
    slow = "0 703#05\n1 703#05\n2 703#05\n"
    written = WRITE_1017.replace("1.01", "2.91")
    assert broken(LOST, f"{slow}2.9 {written}\n3 703#05\n3.1 703#05", 3.2) == []
    ended = written.replace("64", "00")
    assert broken(LOST, f"{slow}2.9 {ended}", 20) == []


def test_a_refused_write_tells_no_period() -> None:
    refused = "1 603#2B17100064000000\n1.01 583#8017100002000106\n1.1 703#05"
    assert broken(LOST, refused, 9) == []


def test_an_eds_tells_the_period_of_a_node_until_it_is_heard() -> None:
    def lost(text: str, end_s: float) -> list[str]:
        checker, records = Checker(LOST, eds_heartbeats={3: 100}), hear(text)
        found = [finding for record in records for finding in checker.take(record)]
        return [one.text for one in found + checker.end(round(end_s * 1e6))]

    assert lost("1 703#05", 1.16) == [
        "can0 node 3: no heartbeat for 160.000 ms, its 1017h says 100.000 ms"
    ]
    assert lost("1 080#", 1.16) == ["node 3: no heartbeat for 160.000 ms, its EDS says 100 ms"]
    assert lost("1 080#", 1.15) == []
    assert lost("1 703#05\n2 703#05\n3 703#05", 4) == []  # heard: one a second
    assert lost("1 703#05\n2 703#05", 3) == []
    assert lost("1 703#05\n2 703#05\n2.1 703#05\n2.2 703#05", 2.2) == [
        "can0 node 3: no heartbeat for 1000.0 ms, its 1017h says 100.000 ms"
    ]
    assert lost("1 703#05\n2 703#00\n3 703#05\n4 703#05\n4.1 703#05", 4.1) == [
        "can0 node 3: no heartbeat for 1000.0 ms, its 1017h says 100.000 ms"
    ]
    assert lost("1 703#R\n1.01 703#85", 9) == []  # guarded
    assert lost(f"1 {WRITE_1017.replace('64', '00')}", 9) == []


@pytest.mark.parametrize(
    "text",
    [
        "1 703#05\n1.1 703#05\n1.15 703#R\n1.2 703#05\n1.3 703#05\n1.4 703#05",
        "1 703#R\n1.01 703#05\n2 703#R\n2.01 703#85\n9 703#R\n9.01 703#05",
    ],
)
def test_requests_of_guarding_lose_no_heartbeat(text: str) -> None:
    assert broken(LOST, text) == []


def unjudged(rules: Rules, text: str, end_s: float | None = None) -> dict[str, str]:
    """Return which rules judge nothing, and why."""
    checker, records = Checker(rules, 500_000), hear(text)
    for record in records:
        checker.take(record)
    end_us = round(end_s * 1e6) if end_s else records[-1].at_us
    checker.end(end_us)
    return dict(checker.unjudged(end_us).rules)


@pytest.mark.parametrize(
    ("words", "text", "why"),
    [
        ({"heartbeat": "3=100ms±20%"}, "1 703#05", "1 frame of error control came, and no gap"),
        ({"heartbeat": "3=100ms±20%"}, "1 703#00\n1.1 703#05", "2 frames of error control"),
        ({"heartbeat": "3=100ms±20%"}, "1 703#05\n1 000#8103\n1.1 703#00", "2 frames of error"),
        ({"heartbeat": "3=100ms±20%"}, "1 703#05\n1 703#05\n1 703#05", "all frames have one time"),
        ({"max_gap": "181=20ms"}, "1 181#\n1.01 182#", "181 came once"),
        ({"max_gap": "181=20ms"}, "1 181#\n1 181#", "all frames have one time"),
        ({"max_load": 50}, "1 181#\n1 181#", "all frames have one time"),
        ({"max_load": 50}, "1 20000080#0000000000000000", "no frame came"),
        ({"no_lost_heartbeat": True}, "1 181#\n2 181#", "no heartbeat came"),
        ({"no_lost_heartbeat": True}, "1 703#05\n2 181#", "of can0 node 3 no period is known"),
        ({"no_lost_heartbeat": True}, "1 703#05\n2 703#05", "of can0 node 3 no period has passed"),
        ({"no_lost_heartbeat": True}, "1 703#85\n2 703#05\n3 703#85", "can0 node 3 is guarded"),
        ({"no_lost_heartbeat": True}, "1 703#05\n1 703#05\n1 703#05", "all frames have one time"),
        ({"no_emcy": True}, "1 18FF1234#00", "no classic frame with an 11-bit CAN-ID came"),
        ({"no_sdo_abort": True}, "1 18FF1234#R", "no classic frame with an 11-bit CAN-ID came"),
        ({"no_reboot": True}, "1 18FF1234#00", "no classic frame with an 11-bit CAN-ID came"),
        ({"known": "181"}, "1 20000080#0000000000000000", "no frame with a CAN-ID came"),
    ],
)
def test_a_rule_that_judges_nothing_says_why(words: dict[str, object], text: str, why: str) -> None:
    ((_, said),) = unjudged(parse_rules(words), text).items()
    assert said.startswith(why)


@pytest.mark.parametrize(
    ("words", "text", "end_s"),
    [
        ({"heartbeat": "3=100ms±20%"}, "1 703#05\n1.1 703#05", None),
        ({"heartbeat": "3=100ms±20%"}, "1 703#00\n1.1 703#05\n1.2 703#05", None),
        ({"heartbeat": "3=100ms±20%"}, "1 703#05\n1.1 703#05\n1.2 703#00\n1.3 703#00", None),
        ({"heartbeat": "3=100ms±20%"}, "1 703#05\n1.1 703#00", None),
        ({"max_gap": "181=20ms"}, "1 181#\n1.01 181#", None),
        ({"max_load": 50}, "1 181#", 5.0),
        ({"no_lost_heartbeat": True}, "1 703#05\n1.1 703#05", 1.2),
        ({"no_lost_heartbeat": True}, "1 703#05\n1.1 703#05\n1.2 703#05\n1.3 703#05", None),
        ({"no_emcy": True, "no_sdo_abort": True, "no_reboot": True}, "1 181#", None),
        ({"no_error_frames": True, "known": "181", "nodes": 1}, "1 181#", None),
    ],
)
def test_a_rule_that_judges_something_does_not(
    words: dict[str, object], text: str, end_s: float | None
) -> None:
    assert unjudged(parse_rules(words), text, end_s) == {}


def test_what_is_not_judged_of_a_node_is_noted_beside_the_others() -> None:
    checker = Checker(LOST)
    for record in hear("1 703#05\n1.1 703#05\n1.15 705#05\n1.2 703#05\n1.3 703#05"):
        checker.take(record)
    checker.end(1_300_000)
    notes = ("no-lost-heartbeat: of can0 node 5 no period is known",)
    assert checker.unjudged(1_300_000) == ({}, notes)


def test_what_a_log_tells_of_errors_breaks_the_rule_against_error_frames_alone() -> None:
    said = ["run.trc: it says that a controller is bus-off: 1 time"]
    checker = Checker(Rules(no_error_frames=True, no_emcy=True))
    found = checker.end(5_000_000, errors=said)
    assert [(one.rule, one.text) for one in found] == [("no-error-frames", said[0])]


def test_a_source_that_has_no_error_frames_proves_nothing() -> None:
    checker = Checker(Rules(no_error_frames=True))
    checker.take(hear("1 181#")[0])
    assert checker.unjudged(0, "a trace holds none").rules == {
        "no-error-frames": "a trace holds none"
    }


def beats(*spans: tuple[float, int, float]) -> str:
    """Return heartbeats of node 3: for each span when it begins, how many, and their gap."""
    times = [at + n * gap for at, count, gap in spans for n in range(count)]
    return "\n".join(f"{time:.6f} 703#05" for time in times)


BURST = (4.0, 31, 0.0002)
"""What a node sends that stood still for 3.1 s: all at once."""


@pytest.mark.parametrize(
    "text",
    [
        beats((0.5, 5, 0.1), BURST, (4.1, 20, 0.1)),
        beats((0.5, 5, 0.1), (4.0, 31, 0.0), (4.1, 20, 0.1)),  # all with one time
        beats((0.5, 5, 0.1), (4.0, 31, 0.003), (4.1, 20, 0.1)),  # on a slow bus
        beats((0.5, 20, 0.1), (5.5, 31, 0.0002), (5.6, 5, 0.1), (8.0, 20, 0.0002), (8.1, 9, 0.1)),
    ],
)
def test_heartbeats_that_a_node_makes_up_for_are_no_period(text: str) -> None:
    found = broken(LOST, text)
    assert len(found) == text.count("\n") // 40
    assert all("one each 100.000 ms before" in line for line in found)


@pytest.mark.parametrize(
    "text",
    [
        beats((0.8, 2, 0.1), BURST, (4.1, 20, 0.1)),  # after one gap
        beats((0.9, 1, 0.1), BURST, (4.1, 20, 0.1)),  # after none: the log begins with it
    ],
)
def test_a_burst_before_the_period_is_known_is_no_period(text: str) -> None:
    assert broken(LOST, text) == []


def test_a_shorter_period_is_learnt() -> None:
    found = broken(LOST, beats((1.0, 9, 1.0), (9.1, 30, 0.1)), end_s=12.2)
    assert found == ["12.2 can0 node 3: no heartbeat for 200.000 ms, one each 100.000 ms before"]


def test_a_second_that_is_too_busy_is_found_when_it_is_over() -> None:
    busy = "\n".join(f"{n / 100:.2f} 181#" for n in range(100))
    assert broken(Rules(max_load=49.5), f"{busy}\n1.5 181#", bit_rate=10_000) == [
        "0 can0: load 50.0 %, at most 49.5 % is right"
    ]
    assert broken(Rules(max_load=50), f"{busy}\n1.5 181#", bit_rate=10_000) == []


def test_a_second_that_is_not_over_is_judged_at_the_end() -> None:
    assert len(broken(Rules(max_load=0), "1 181#", bit_rate=10_000)) == 1


def test_the_last_half_second_is_judged_by_its_own_time() -> None:
    busy = "0 181#\n" + "\n".join(f"{1 + n / 100:.2f} 181#" for n in range(51))
    assert broken(Rules(max_load=50), busy, bit_rate=10_000) == [
        "1 can0: load 51.0 %, at most 50 % is right"
    ]
    assert broken(Rules(max_load=50), busy.rpartition("\n")[0], bit_rate=10_000) == []


@pytest.mark.parametrize(("last_s", "notes"), [(0.5, ()), (0.4, ("less than 0.5 s",))])
def test_a_load_of_a_short_log_is_noted(last_s: float, notes: tuple[str, ...]) -> None:
    checker = Checker(Rules(max_load=50), 10_000)
    for record in hear(f"0 181#\n{last_s} 181#"):
        checker.take(record)
    end_us = round(last_s * 1e6)
    assert checker.end(end_us) == []
    said = checker.unjudged(end_us).notes
    assert said == tuple(f"max-load: the traffic lasts {one}" for one in notes)


def test_a_load_without_a_bit_rate_is_refused() -> None:
    with pytest.raises(ValueError, match="a limit of the load needs the bit rate: give -b"):
        Checker(Rules(max_load=50))


def test_what_was_lost_is_a_finding_of_its_rule_alone() -> None:
    assert len(Checker(Rules(no_loss=True)).end(0, ["12 frames"])) == 1
    assert Checker(Rules(no_emcy=True)).end(0, ["12 frames"]) == []
