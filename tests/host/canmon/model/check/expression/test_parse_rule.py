from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.check.expression.held import MAPPED, findings
from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.check.rule import NoEmcy, NoErrorFrames, NoSdoAbort
from tickrig.host.canmon.model.check.rule_parser import (
    BEHIND,
    DEMANDS,
    SCOPES,
    RuleError,
    parse_rule,
)
from tickrig.host.canmon.model.check.rules import joined, parse_rules

WANTED = f"wanted {', '.join(DEMANDS)}, or 'and', 'or'"


@pytest.mark.parametrize(
    ("text", "column", "reason"),
    [
        ("", 1, "a term is missing, as emcy, node=3, 181-18F or statusword.fault"),
        ("emcy of 3", 10, f"the end is no demand; {WANTED}"),
        ("node 3 opertional within 2s", 8, f"'opertional' is no demand; {WANTED}; did you mean"),
        ("3.statusword.fault nevr", 20, f"'nevr' is no demand; {WANTED}; did you mean 'never'?"),
        ("emcy of 128 never", 9, "'128' is no node-ID 1 to 127, as 3 or 3-5"),
        ("dlc of x", 8, "'x' is no node-ID 1 to 127, as 3 or 3-5"),
        ("node = never", 8, "'never' is no number"),
        ("tpdo1 every 10ms", 17, "the end behind the time; wanted how far off is right, as ±10%,"),
        ("tpdo1 every 10ms ±x", 19, "'x' is neither a share, as 10%, nor a time, as 500us"),
        ("tpdo1 every 10", 13, "'10' is no time, as 2s, 50ms or 250us"),
        ("tpdo1 every 10 ms ±10%", 13, "'10' is no time, as 2s, 50ms or 250us; without"),
        ("tpdo1 every 10ms ±10 %", 19, "'10' is neither a share, as 10%, nor a time, as 500us; w"),
        ("tpdo1 after sync within 2ms", 7, "'after' is no demand; it stands behind the demand"),
        ("emcy operational never", 6, "'operational' is no demand; it stands behind a node, as "),
        ("emcy of 5-3 never", 9, "'5-3' is no node-ID 1 to 127, as 3 or 3-5; the lower one st"),
        ("tpdo1 every 9ms..5ms", 21, "the time before '..' is above the one behind it"),
        ("sync to tpdo1 of 3", 19, "the end where 'under' or 'within' and a time are wanted"),
        ("sync to under 2ms", 15, "'2ms' where 'under' or 'within' and a time are wanted"),
        ("sdo answered 50ms", 14, "'50ms' where 'under' or 'within' and a time are wanted"),
        ("emcy in", 8, "the end where a value is wanted, as 8130h, 5..9 or {1, 2}"),
        ("emcy in {8130h", 15, "'}' is missing"),
        ("x in 5..1", 10, "5..1 is no range of values, as -5..5, 0.. or ..100"),
        ("x in a..b", 10, "'a' is no number, as an end of a range is"),
        ("x in nan..1", 12, "'nan' is no number, as an end of a range is"),
        ("x > 3 in 1..2", 7, "'in' is about one signal, as 3.position, or about one kind"),
        ("x steps under wide", 15, "'wide' is no number"),
        ("emcy always", 6, "'always' wants a signal or a state, as 3.statusword.fault or node 3"),
        ("emcy never while sync", 12, "'while' wants a signal or a state"),
        ("emcy at 3", 9, "'3' behind 'at'; wanted most or least"),
        ("emcy at most many", 14, "'many' is no count, as 3"),
        ("emcy at most 99999 per 1s", 24, "at most 99999: at most 10000 can be counted in a time"),
        ("181[2:4 never", 14, "']' is missing"),
        ("sync or 181[x] never", 9, "'181[x]' is not ID[BYTES]TYPE*FACTOR+OFFSET, as 181[2:6]s"),
        ("181[2:4] > fast never", 12, "'fast' is no number"),
        ("emcy never today", 12, "'today' behind the end; wanted after, before, while, or no more"),
        ("tpdo1 of 3-5 to sdo of 4-5 under 1s", 1, "nodes 3-5 and 4-5: a rule that is made for"),
    ],
)
def test_a_rule_that_is_none_is_refused_with_its_column(
    text: str, column: int, reason: str
) -> None:
    with pytest.raises(RuleError) as refused:
        parse_rule(text)
    assert str(refused.value).startswith(f"rule {text!r}, column {column}: {reason}")
    assert refused.value.column == column


def test_what_stands_behind_a_demand_is_shown_by_a_rule() -> None:
    for text in BEHIND.values():
        _, _, example = text.partition(" as ")
        assert parse_rule(example if "demand" in text else f"{example} within 2s").texts


def test_a_range_makes_a_rule_for_each_node_where_each_must_come() -> None:
    assert len(parse_rule("node 3-5 operational within 2s").texts) == 3
    assert parse_rule("sync to tpdo1 of 4-5 under 2ms").texts == (
        "sync to tpdo1 of 4 under 2ms",
        "sync to tpdo1 of 5 under 2ms",
    )
    for text in ("emcy of 3-5 never", "pdo and not tpdo of 3-5 at most 0", "dlc of 3-5"):
        assert parse_rule(text).texts == (text,)


def test_a_rule_has_the_name_that_it_is_given() -> None:
    listed = parse_rules({"rule": ["no fault: 3.statusword.fault never", "dlc"]})
    table = parse_rules({"rule": {"no fault": "3.statusword.fault never", "lengths": "dlc"}})
    assert listed.names() == ["no fault", "dlc"]
    assert table.names() == ["no fault", "lengths"]
    both = joined({"rule": {"lengths": "dlc"}}, {"rule": ["sync never"]})
    assert parse_rules(both).names() == ["lengths", "sync never"]


def test_a_name_is_one_line_that_can_be_printed() -> None:
    assert parse_rules({"rule": "emcy\n of 3\tnever"}).names() == ["emcy of 3 never"]
    for name in ("a\nb", "\udcff", "\0"):
        with pytest.raises(RuleError, match=r"its name .* cannot be printed"):
            parse_rules({"rule": {name: "dlc"}})


NAMED = dict(zip(("one", "two", "three"), (NoEmcy, NoSdoAbort, NoErrorFrames), strict=True))


def test_names_are_rules_of_other_packages() -> None:
    rules = parse_rules({"rule": ["one, two", "dlc", "three"]}, lambda name: NAMED[name])
    assert rules.others == tuple(NAMED.values())
    assert [one.name for one in rules.expressions] == ["dlc"]


WORDS = (
    *("node", "3", "3-5", "of", "emcy", "sdo", "sync", "tpdo1", "3.statusword.fault", "speed"),
    *("operational", "10ms", "±10%", "±", "+-", "..", "{", "}", ",", "1", "8130h", "nan", "("),
    *(")", "and", "or", "not", "=", "<", "most", "least", "per", "under", "181-18F", "[6040h]"),
    *("-1", "1e400", "0x", "#FF", "dlc", "toggle", "181", "[", "]", "181[2:4]s", "2:4"),
    *(word for demand in DEMANDS for word in demand.split()),
    *SCOPES,
)
TRAFFIC = hear(
    MAPPED + "1 183#370264000000\n1.1 083#3081110000000000\n1.2 603#4000100000000000\n1.3 703#R\n"
    "1.4 703#85\n1.5 080#01\n1.6 000#0103\n1.7 703#00\n1.8 20000020#0000000000000000"
)


@given(st.lists(st.sampled_from(WORDS), max_size=9).map(" ".join))
def test_any_words_are_a_rule_or_refused(text: str) -> None:
    try:
        rules = parse_rules({"rule": ["x: " + text]})
    except RuleError:
        return
    if rules.expressions:
        assert all(one.rule == "x" for one in findings("x: " + text, TRAFFIC))


@given(st.text(max_size=40))
def test_any_text_is_a_rule_or_refused(text: str) -> None:
    try:
        parse_rule(text)
    except RuleError:
        return


PAGE = (Path(__file__).parents[6] / "docs" / "reference/canmon/canmon-model.md").read_text("utf-8")
WRITTEN = PAGE.partition("### Rules that are written out")[2].partition("\n- ")[0]
ROWS = re.findall(r"^\| (`.*?) \|", WRITTEN, re.MULTILINE)


def test_each_rule_of_the_page_is_one() -> None:
    rules = [rule for row in ROWS for rule in re.findall(r"`([^`]*)`", row) if "..." not in rule]
    assert len(rules) > 25
    for rule in rules:
        assert parse_rule(rule).name == rule


def test_the_file_of_the_page_is_read() -> None:
    text = PAGE.partition("```toml\n")[2].partition("```")[0]
    assert parse_rules(tomllib.loads(text)).names()[-2:] == ["drive enables", "lengths"]
