from __future__ import annotations

import pytest

from tests.host.canmon.model.check.expression.held import MAPPED, broken, unjudged

EMCY = "083#3081110000000000"


def test_what_never_comes_is_told_each_time() -> None:
    found = broken("emcy never", f"1 {EMCY}\n2 703#05\n3 {EMCY}")
    assert [line[:16] for line in found] == ["1 emcy of node 3", "3 emcy of node 3"]
    assert broken("emcy of 4 never", f"1 {EMCY}") == []


RESET = "083#0000000000000000"


@pytest.mark.parametrize(
    ("rule", "found"),
    [
        ("emcy never", "1"),
        ("emcy of 3 never", "1"),
        ("kind = emcy never", "1"),
        ("emcy or sync never", "1"),
        ("emcy at most 0", "1"),
        ("emcy at least 2", "3"),
        ("emcy never after emcy", ""),
        ("emcy and code = 0 never", "2"),
        ("083 never", "12"),
        ("not emcy never", "3"),
        ("not 703 never", "12"),
    ],
)
def test_the_end_of_an_error_is_none(rule: str, found: str) -> None:
    text = f"1 {EMCY}\n2 {RESET}\n3 703#05"
    assert "".join(line[0] for line in broken(rule, text)) == found


def test_the_end_of_an_error_has_a_length() -> None:
    assert broken("emcy of 3 dlc", "1 083#00000000")[0].startswith("1 emcy of node 3 has 4 B")


def test_a_boot_up_comes_once() -> None:
    rule = "boot-up of 3 once"
    assert broken(rule, "1 703#00") == []
    assert broken(rule, "1 704#00") == ["1 boot-up of 3 came 0 times, at least 1 is right"]
    assert broken(rule, "1 703#00\n2 703#00\n3 703#00") == [
        "2 boot-up of 3 came 2 times, at most 1 is right"
    ]


def test_a_count_has_limits() -> None:
    text = f"1 {EMCY}\n2 {EMCY}\n3 {EMCY}"
    assert broken("emcy at most 3", text) == broken("emcy at least 3", text) == []
    assert broken("emcy at most 2", text) == ["3 emcy came 3 times, at most 2 is right"]
    assert broken("emcy at least 4", text) == ["3 emcy came 3 times, at least 4 is right"]


def test_a_rate_has_a_limit() -> None:
    rule = "emcy at most 2 per 1s"
    assert broken(rule, f"1 {EMCY}\n1.5 {EMCY}\n2 {EMCY}\n2.5 {EMCY}") == []
    assert broken(rule, f"1 {EMCY}\n1.5 {EMCY}\n1.9 {EMCY}\n2 {EMCY}") == [
        "1.9 emcy came 3 times in 900.000 ms, at most 2 in 1000.0 is right"
    ]
    assert len(broken("emcy at most 0 per 1s", f"1 {EMCY}")) == 1


@pytest.mark.parametrize(
    ("rule", "at_s"),
    [
        ("emcy never after node 3 operational", ["4", "6"]),
        ("emcy never before node 3 operational", ["1"]),
        ("emcy never while node 3 operational", ["4"]),
        ("emcy never after node 3 operational before node 3 stopped", ["4"]),
    ],
)
def test_a_rule_holds_when_it_says(rule: str, at_s: list[str]) -> None:
    text = f"1 {EMCY}\n2 703#7F\n3 703#05\n4 {EMCY}\n5 703#04\n6 {EMCY}"
    assert [line[0] for line in broken(rule, text)] == at_s


def test_a_period_begins_anew_with_its_scope() -> None:
    rule = "tpdo1 of 3 every 10ms ±10% while node 3 operational"
    text = "1 703#05\n1.01 183#\n1.02 183#\n1.025 703#04\n2 703#05\n2.3 183#\n2.31 183#"
    assert broken(rule, MAPPED + text) == []
    assert broken(rule, MAPPED + text + "\n2.33 183#")[0].startswith("2.33 node 3: 20.000 ms")


def test_a_condition_holds_with_the_frame_that_makes_it_true() -> None:
    rule = "3.position_actual_value in ..99 while 3.statusword.operation_enabled"
    text = "1 183#330264000000\n2 183#370264000000"
    assert [line[0] for line in broken(rule, MAPPED + text)] == ["2"]


def test_a_rule_that_holds_after_an_event_does_not_judge_it() -> None:
    assert broken("boot-up of 3 never after boot-up of 3", "1 703#00\n2 703#05") == []
    assert len(broken("boot-up of 3 never after boot-up of 3", "1 703#00\n2 703#00")) == 1


def test_a_condition_that_lasts_is_told_again_in_the_next_scope() -> None:
    rule = "3.statusword.fault never while node 3 operational"
    text = "1 703#05\n2 183#3F0200000000\n3 703#04\n4 703#05\n5 183#3F0200000000"
    assert [line[0] for line in broken(rule, MAPPED + text)] == ["2", "5"]


CUT = "085#2032"
TWO = "1 085#2032050000000000\n2 085#3081110000000000\n3 085#2032050000000000"


@pytest.mark.parametrize(
    ("rule", "found"),
    [
        ("emcy of 5 and code = 3220h never", "13"),
        ("(emcy of 5 and code = 3220h) never", "13"),
        ("code = 3220h and emcy of 5 never", "13"),
        ("emcy and register = 5 never", "13"),
        ("code = 3220h never", "13"),
        ("5.code = 3220h never", "13"),
        ("code in {8130h} ", "13"),
        ("085 and code = 3220h always", "2"),
        ("emcy of 4 and code = 3220h always", ""),
        ("emcy or statusword.fault never", "1234"),
        ("emcy and code = 3220h or sync never", "13"),
        ("emcy of 5 and code = 3220h at most 1", "3"),
        ("node = 5 and code = 3220h never", "13"),
    ],
)
def test_a_comparison_at_a_frame_is_judged_at_each(rule: str, found: str) -> None:
    text = f"0 705#05\n{TWO}\n4 {CUT}"
    lines = broken(rule, text)
    said = [line for line in lines if "no signal" not in line and not line.startswith("4 nothing")]
    assert "".join(line[0] for line in said) == found


@pytest.mark.parametrize(
    "rule",
    [
        "emcy of 5 and code = 3220h never",
        "emcy and register = 5 never",
        "code = 3220h never",
        "emcy and code = 0 never after boot-up",
        "nmt and command = stop never",
        "emcy and register.2 never",
        "code = 8130h always",
        "code in {8130h}",
        "emcy and node 5 stopped never",
    ],
)
def test_a_rule_about_an_event_that_did_not_come_holds(rule: str) -> None:
    text = "1 705#00\n2 705#05"
    assert (broken(rule, text), unjudged(rule, text)) == ([], "")


def test_a_state_at_a_frame_is_the_latest_on_its_bus() -> None:
    text = f"1 705#7F\n2 {EMCY}\n3 705#05\n4 {EMCY}\n5 {RESET}\n6 {EMCY}\n7 705#04\n8 {EMCY}"
    assert [one[0] for one in broken("emcy and node 5 operational never", text)] == ["4", "6"]
    assert [one[0] for one in broken("emcy and node 5 operational always", text)] == ["2", "8"]
    assert [one[0] for one in broken("emcy and not node 5 operational never", text)] == ["2", "8"]
    assert [
        one[0] for one in broken("sync and node 5 operational never", "1 705#05\n2 080#\n3 080#")
    ] == [
        "2",
        "3",
    ]
    late = "emcy and node 5 operational never after node 5 stopped"
    assert broken(late, f"1 705#04\n2 705#05\n3 {EMCY}")[0][0] == "3"
    assert broken("emcy and node 6 operational never", text)[0].endswith("of node 6 came")
