"""A rule that is written out, held against few frames."""

from __future__ import annotations

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.check.checker import Checker
from tickrig.host.canmon.model.check.rule import TrafficFinding
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record

MAPPED = "0.1 583#4F001A0002000000\n0.1 583#43001A0110004160\n0.1 583#43001A0220006460\n"
"""TPDO1 of node 3 carries statusword and actual position: both are read from the node."""


def findings(rule: str, records: list[Record], end_us: int | None = None) -> list[TrafficFinding]:
    """Return all findings."""
    checker, decoder = Checker(parse_rules({"rule": [rule]})), Decoder()
    found = [one for record in records for one in checker.take(record, decoder.take(record))]
    return found + checker.end(records[-1].at_us if end_us is None else end_us)


def broken(rule: str, text: str, end_s: float | None = None) -> list[str]:
    """Return what is found, as text with the time in seconds before it."""
    end_us = None if end_s is None else round(end_s * 1e6)
    found = findings(rule, hear(text), end_us)
    return [f"{one.at_us / 1e6:g} {one.text}" for one in found]


def unjudged(rule: str, text: str, end_s: float | None = None) -> str:
    """Return why a rule has judged nothing; empty if it has, or has found something."""
    checker, decoder, records = Checker(parse_rules({"rule": [rule]})), Decoder(), hear(text)
    found = [one for record in records for one in checker.take(record, decoder.take(record))]
    end_us = records[-1].at_us if end_s is None else round(end_s * 1e6)
    found += checker.end(end_us)
    return "" if found else checker.unjudged(end_us).rules.get(rule, "")
