from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.column_log import blocks
from tests.host.canmon.model.strategies import traffic
from tickrig.host.canmon.model.check.checker import Checker, Unjudged
from tickrig.host.canmon.model.check.column_check import ColumnChecker
from tickrig.host.canmon.model.check.rule import HeartbeatTimes, TrafficFinding
from tickrig.host.canmon.model.check.rules import Rules
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame

BIT_RATE = 1_000
WRITTEN = ("603#2B17100064000000", "583#6017100000000000", "083#3081", "583#8000100000")
EDS = {3: 100, 9: 1_000}
ALL = Rules(
    max_load=20,
    no_emcy=True,
    no_sdo_abort=True,
    no_error_frames=True,
    no_reboot=True,
    no_lost_heartbeat=True,
    no_loss=True,
    heartbeats=(HeartbeatTimes(3, 80_000, 120_000),),
    nodes=(3, 5),
    max_gaps=((0x181, 100_000), (0x7FF, 200)),
    known=frozenset({0x000, 0x181, 0x703}),
)


Judged = tuple[list[TrafficFinding], Unjudged]


def one_by_one(records: list[Record], rules: Rules) -> Judged:
    checker = Checker(rules, BIT_RATE, eds_heartbeats=EDS)
    found = [finding for record in records for finding in checker.take(record)]
    end_us = records[-1].at_us if records else 0
    found += checker.end(end_us, ["a line is none"], errors=["it says so"])
    return found, checker.unjudged(end_us)


def in_blocks(records: list[Record], rules: Rules, size: int) -> Judged:
    checker = ColumnChecker(rules, BIT_RATE, EDS)
    found = [finding for block in blocks(records, size) for finding in checker.take(block)]
    found += checker.end(["a line is none"], ["it says so"])
    return found, checker.unjudged()


@pytest.mark.parametrize("size", [1, 7, 100])
@given(records=traffic())
def test_a_log_in_blocks_has_the_same_findings_as_frame_by_frame(
    size: int, records: list[Record]
) -> None:
    assert in_blocks(records, ALL, size) == one_by_one(records, ALL)


@given(
    st.lists(
        st.tuples(
            st.sampled_from([0, 79_999, 100_000, 120_001, 500_000]),
            st.sampled_from(
                [
                    *("703#00", "703#05", "703#", "703#85", "703#R", "000#8103", "000#8200"),
                    *("709#00", "000#8109", "000#0103", *WRITTEN),
                ]
            ),
        ),
        max_size=30,
    )
)
def test_boots_and_heartbeats_are_judged_the_same(steps: list[tuple[int, str]]) -> None:
    at_us, records = 0, []
    for step_us, text in steps:
        at_us += step_us
        records.append(Record(at_us, "can0", CanFrame.parse(text)))
    assert in_blocks(records, ALL, 5) == one_by_one(records, ALL)
