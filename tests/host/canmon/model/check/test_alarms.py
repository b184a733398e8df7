from __future__ import annotations

import pytest

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.check.checker import (
    GRACE_US,
    KEPT,
    LATE_US,
    RECENT_US,
    Alarms,
    AlarmState,
    render_alarms,
)
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.decode.decoder import Decoder

S = 1_000_000


def alarms(**words: object) -> Alarms:
    made = Alarms(parse_rules(words))
    made.check_missing(0)
    return made


def taken(made: Alarms, text: str) -> Alarms:
    for record in hear(text):
        made.take(record)
        made.check_missing(record.at_us)
    return made


def states(made: Alarms, now_us: int) -> list[AlarmState]:
    made.check_missing(now_us)
    return [alarm.state(now_us) for alarm in made.rows()]


def test_a_rule_is_broken_for_a_while_and_then_was_until_it_is_acknowledged() -> None:
    made = taken(alarms(no_emcy=True), "1.0 083#3081110000000000")
    assert states(made, S + RECENT_US - 1) == [AlarmState.BROKEN]
    assert made.broken(S) == 1
    assert states(made, S + RECENT_US) == [AlarmState.WAS_BROKEN]
    made.acknowledge()
    assert states(made, S + RECENT_US) == [AlarmState.HOLDS]
    assert [alarm.count for alarm in made.rows()] == [1]


def test_before_any_frame_no_rule_is_said_to_hold() -> None:
    made = alarms(no_emcy=True, nodes=3)
    made.check_missing(GRACE_US)
    shown = [line.split()[:3] for line in render_alarms(made, GRACE_US)[1:3]]
    assert shown == [["no-emcy", "no", "frame"], ["nodes", "BROKEN", "1"]]


def test_a_heartbeat_that_stops_is_one_finding_however_long_it_lasts() -> None:
    made = taken(alarms(heartbeat="5=100ms±20%"), "2.9 705#05\n3.0 705#05")
    assert states(made, 3 * S + 120_000) == [AlarmState.HOLDS]
    for now_us in range(3_200_000, 9_000_000, 100_000):
        assert states(made, now_us) == [AlarmState.BROKEN]
    (alarm,) = made.rows()
    assert (alarm.count, len(made.findings)) == (1, 1)
    assert alarm.finding is not None
    assert alarm.finding.text.startswith("node 5: 5900.0 ms since its last heartbeat")


def test_a_heartbeat_that_is_back_was_broken() -> None:
    made = taken(alarms(heartbeat="5=100ms±20%"), "3.0 705#05")
    made.check_missing(5 * S)
    for now_us in range(50, 80):
        taken(made, f"{now_us / 10} 705#05")
    assert states(made, 7_950_000) == [AlarmState.WAS_BROKEN]


def test_what_has_never_come_is_missed_after_a_time_of_grace() -> None:
    made = alarms(nodes="3,4")
    assert states(made, GRACE_US - 1) == [AlarmState.HOLDS]
    assert states(made, GRACE_US) == [AlarmState.BROKEN]
    assert made.findings[0].text == "node 3 was never seen; node 4 was never seen"


def test_the_grace_begins_with_the_time_of_the_source() -> None:
    made = Alarms(parse_rules({"nodes": 3}))
    made.check_missing(1_700_000_000 * S)
    assert states(made, 5 * S) == [AlarmState.HOLDS]
    assert states(made, 5 * S + GRACE_US) == [AlarmState.BROKEN]


def test_frames_that_get_lost_are_found_as_they_do() -> None:
    made = alarms(no_loss=True)
    made.check_missing(S, 5)
    made.check_missing(2 * S, 5)
    assert [finding.text for finding in made.findings] == ["5 frames were lost"]


def test_a_loss_before_the_rules_is_none_of_theirs() -> None:
    made = Alarms(parse_rules({"no_loss": True}))
    made.check_missing(0, 7)
    assert not made.findings


def test_clearing_begins_anew() -> None:
    made = taken(alarms(no_emcy=True), "1.0 083#3081110000000000")
    made.clear()
    assert (states(made, S), list(made.findings)) == ([AlarmState.HOLDS], [])


def test_only_the_latest_findings_are_kept_and_all_are_counted() -> None:
    made = alarms(no_error_frames=True)
    taken(made, "1.0 20000004#0000000000000000\n" * (KEPT + 1))
    assert (len(made.findings), made.rows()[0].count) == (KEPT, KEPT + 1)


def test_a_limit_of_the_load_needs_the_bit_rate() -> None:
    with pytest.raises(ValueError, match="needs the bit rate"):
        Alarms(parse_rules({"max_load": 50}))


TABLE = """\
RULE                 STATE       COUNT      AGO  LATEST
no-emcy              BROKEN          1    0.5 s  node 3: EMCY 8130h life guard error or heartbeat error
no-reboot            holds           0

FINDINGS, latest first: 1
(1.000000) no-emcy: node 3: EMCY 8130h life guard error or heartbeat error [can0 083#3081110000000000]"""  # noqa: E501 - as it is shown


def test_alarms_are_shown_like_this() -> None:
    made = taken(alarms(no_emcy=True, no_reboot=True), "1.0 083#3081110000000000")
    assert "\n".join(render_alarms(made, 1_500_000)) == TABLE


def written(rule: str, text: str, now_us: int) -> Alarms:
    made, decoder = alarms(rule=[rule]), Decoder()
    for record in hear(text):
        made.take(record, decoder.take(record))
    made.check_missing(now_us)
    return made


def test_a_written_rule_is_an_alarm() -> None:
    made = written("emcy at most 1", "1 083#3081110000000000\n1.5 083#3081110000000000", 2 * S)
    assert states(made, 2 * S) == [AlarmState.BROKEN]
    assert [str(one)[:26] for one in made.findings] == ["(1.500000) emcy at most 1:"]
    made.clear()
    assert states(made, 2 * S) == [AlarmState.HOLDS]


def test_what_a_written_rule_waits_for_is_missed_on_a_silent_bus() -> None:
    made = written("node 3 operational within 2s", "1 703#00", 3 * S)
    assert states(made, 3 * S + LATE_US) == [AlarmState.HOLDS]
    assert states(made, 3 * S + LATE_US + 1) == [AlarmState.BROKEN]
    assert [one.at_us for one in made.findings] == [3 * S]


def test_a_period_that_is_not_kept_is_one_finding_however_long_it_lasts() -> None:
    made = written("heartbeat of 3 every 100ms ±10%", "1 703#05\n1.1 703#05", S)
    for now_us in range(3 * S, 6 * S, 100_000):
        assert states(made, now_us) == [AlarmState.BROKEN]
    assert len(made.findings) == 1


def test_a_long_rule_does_not_push_its_state_off_the_screen() -> None:
    made = written("heartbeat of 3 every 100ms ±10% while node 3 operational", "1 703#05", S)
    head, line = render_alarms(made, S)[:2]
    assert line.startswith("heartbeat of 3 every 100ms ±10% while n… holds ")
    assert head.index("STATE") == line.index("holds")
