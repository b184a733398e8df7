from __future__ import annotations

import pytest

from tests.host.canmon.model.check.expression.held import MAPPED, broken


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        ("183#3702", "tpdo1 of node 3 has 2 B, 6 is right by its mapping"),
        ("183#370264000000FF", "tpdo1 of node 3 has 7 B, 6 is right by its mapping"),
        ("703#0500", "heartbeat of node 3 has 2 B, 1 is right"),
        ("080#0102", "sync has 2 B, 0 or 1 is right"),
        ("603#40001000", "sdo of node 3 has 4 B, 8 is right"),
        ("583#43", "sdo of node 3 has 1 B, 8 is right"),
        ("000#01", "nmt has 1 B, 2 is right"),
        ("083#3081", "emcy of node 3 has 2 B, 8 is right"),
        ("100#00", "time has 1 B, 6 is right"),
        ("7E5#04", "lss has 1 B, 8 is right"),
    ],
)
def test_a_length_that_the_standard_does_not_have_is_found(frame: str, said: str) -> None:
    assert broken("dlc", MAPPED + f"1 {frame}") == [f"1 {said}"]


@pytest.mark.parametrize("frame", ["183#370264000000", "283#00", "703#R", "080#", "080#01", "7FF#"])
def test_a_length_that_is_right_or_that_nobody_knows_is_not_found(frame: str) -> None:
    assert broken("dlc", MAPPED + f"1 {frame}") == []


@pytest.mark.parametrize(
    ("rule", "count"), [("dlc of 3", 2), ("dlc of 4-5", 0), ("tpdo1 of 3 dlc", 1), ("sync dlc", 1)]
)
def test_lengths_of_some_frames_alone_are_judged(rule: str, count: int) -> None:
    assert len(broken(rule, MAPPED + "1 183#00\n2 080#0102\n3 703#0500")) == count


def test_a_toggle_bit_that_stands_still_is_found() -> None:
    rule = "guard toggle"
    guarded = "1 703#R\n1.01 703#05\n2 703#R\n2.01 703#85\n3 703#R\n3.01 703#05"
    assert broken(rule, guarded) == []
    assert broken(rule, f"{guarded}\n4 703#R\n4.01 703#05") == [
        "4.01 guard of node 3: operational, toggle 0: toggle 1 is right"
    ]
    assert broken("guard of 4 toggle", f"{guarded}\n4 703#R\n4.01 703#05") == []


def test_a_heartbeat_has_no_toggle_bit() -> None:
    assert broken("guard toggle", "1 703#05\n2 703#05") == []


def test_the_toggle_bit_begins_with_0_after_a_boot_up() -> None:
    guarded = "1 703#R\n1.01 703#05\n2 703#00\n3 703#R\n3.01 703#7F"
    assert broken("guard toggle", guarded) == []
    assert len(broken("guard toggle", guarded.replace("703#7F", "703#FF"))) == 1


def test_a_heartbeat_behind_a_single_request_is_no_answer_for_ever() -> None:
    beats = "1 703#R\n1.1 703#05\n1.2 703#05\n1.3 703#05\n1.4 703#05"
    assert broken("guard toggle", beats) == []
    assert broken("guard toggle", f"{beats}\n2 703#R\n2.1 703#05\n2.2 703#05") == []


def test_an_answer_stands_still_though_its_request_is_not_in_the_log() -> None:
    assert len(broken("guard toggle", "1 703#05\n2 703#85\n3 703#85\n4 703#05")) == 1


def test_a_first_answer_without_its_request_excuses_no_others() -> None:
    text = "1 703#05\n2 703#R\n2.01 703#05\n3 703#R\n3.01 703#05"
    assert len(broken("guard toggle", text)) == 1
