from __future__ import annotations

import re

import pytest

from tickrig.host.canmon.model.check.rule import HeartbeatTimes
from tickrig.host.canmon.model.check.rules import Rules, parse_rules


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("3=100ms±20%", (3, 80_000, 120_000)),
        ("3=100ms+-20%", (3, 80_000, 120_000)),
        ("127=1s±5ms", (127, 995_000, 1_005_000)),
        ("1=10ms±200%", (1, 0, 30_000)),
    ],
)
def test_heartbeats_are_read(text: str, times: tuple[int, int, int]) -> None:
    assert parse_rules({"heartbeat": text}).heartbeats == (HeartbeatTimes(*times),)


def test_a_table_is_read_as_a_list_is() -> None:
    table = {"heartbeat": {"3": "100ms±20%"}, "max_gap": {"181": "20ms"}, "nodes": [3, "5-6"]}
    listed = {"heartbeat": ["3=100ms±20%"], "max_gap": ["181=20ms"], "nodes": "3, 5-6"}
    assert parse_rules(table) == parse_rules(listed)
    assert parse_rules(table).nodes == (3, 5, 6)


def test_no_words_are_no_rules() -> None:
    assert parse_rules({}) == Rules()


def test_nothing_known_is_a_rule_and_nothing_said_is_none() -> None:
    assert parse_rules({"known": []}).known == frozenset()
    assert parse_rules({}).known is None


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ({"emcy": True}, "rule 'emcy' is not one of no_emcy, no_sdo_abort,"),
        ({"no_emcy": 1}, "no_emcy = 1 is not true or false"),
        ({"max_load": "60"}, "max_load '60' is not 0 to 100 percent"),
        ({"max_load": 101}, "max_load 101 is not 0 to 100 percent"),
        ({"max_load": True}, "max_load True is not 0 to 100 percent"),
        ({"bitrate": "500k"}, "bitrate '500k' is not a number of bits a second, as 500000"),
        ({"bitrate": 0}, "bitrate 0 is not"),
        ({"bitrate": True}, "bitrate True is not"),
        ({"heartbeat": "3=100ms"}, "heartbeat '3=100ms' is not like 3=100ms±20%"),
        ({"heartbeat": "128=100ms±1%"}, "heartbeat '128=100ms±1%' is not like"),
        ({"heartbeat": "3=soon±1%"}, "'soon' is not a time"),
        ({"nodes": "x"}, "nodes 'x' is not like 3 or 3-7"),
        ({"nodes": "0-3"}, "nodes '0-3': node-IDs are 1 to 127"),
        ({"nodes": "5-3"}, "nodes '5-3': the lower node-ID stands first, as 3-5"),
        *[
            ({"nodes": text}, f"nodes {text!r} is not like 3 or 3-7")
            for text in ("1-", "-5", "1-2-3", "", "-", "1-x", "\u0661", "1-\u0662", "0x3", "1 2")
        ],
        ({"nodes": ["1-"]}, "nodes '1-' is not like 3 or 3-7"),
        ({"nodes": ["3", "1-2-3"]}, "nodes '1-2-3' is not like 3 or 3-7"),
        ({"nodes": 128}, "nodes '128': node-IDs are 1 to 127"),
        ({"nodes": [1, 999]}, "nodes '999': node-IDs are 1 to 127"),
        ({"nodes": [True]}, "nodes 'True' is not like"),
        ({"nodes": [1.0]}, "nodes '1.0' is not like"),
        ({"nodes": []}, "nodes is empty: leave it out"),
        ({"heartbeat": {}}, "heartbeat is empty: leave it out"),
        ({"max_gap": []}, "max_gap is empty: leave it out"),
        ({"rule": []}, "rule is empty: leave it out"),
        *[
            ({"known": text}, f"known {text!r} is not like 181 or 181-18F")
            for text in ("181-", "-181", "181-182-183", "", "-")
        ],
        ({"known": "181-00000185"}, "known '181-00000185': write both ends alike"),
        ({"known": "181-185R"}, "known '181-185R': write both ends alike"),
        ({"known": "\u0661\u0662\u0663"}, "is not a CAN-ID"),
        ({"known": "00000000-1FFFFFFF"}, "known '00000000-1FFFFFFF': "),
        ({"heartbeat": "\u0663=100ms±20%"}, "is not like 3=100ms±20%"),
        ({"heartbeat": "0=100ms±20%"}, "is not like 3=100ms±20%"),
        ({"heartbeat": "3=-100ms±20%"}, "'-100ms' is not a time"),
        ({"max_gap": "181=\u0662ms"}, "is not a time"),
        ({"max_gap": "181=-2ms"}, "'-2ms' is not a time"),
        ({"max_gap": "181"}, "'' is not a time"),
        ({"max_gap": "18=1ms"}, "'18' is not a CAN-ID"),
        ({"known": "18F-181"}, "known '18F-181': 18F is not below the other end"),
    ],
)
def test_what_is_no_rule_is_said(words: dict[str, object], reason: str) -> None:
    with pytest.raises(ValueError, match=re.escape(reason)):
        parse_rules(words)
