from __future__ import annotations

import logging

import pytest

from tests.host.rigs import ScriptedLink
from tickrig.host.rrc import Arrival, RrcClient
from tickrig.host.rrc.inbox import UNKNOWN_KEPT


@pytest.mark.parametrize(
    "line",
    [
        b"SB:00112233",
        b"hello",
        b"\xff\x00\x80",
        b"",
        b"SA:00000000A10001",  # wrong CHECK
        b"SA:00000000A1000",  # too short
        b"SA:00000000A60005",  # no such speed mode
    ],
)
def test_a_line_that_means_nothing_is_reported_and_not_fatal(line: bytes) -> None:
    link, reported = ScriptedLink(), list[Arrival[str]]()
    client = RrcClient(link, on_unknown=reported.append)
    link.comes(1_000, line + b"\nEV:Initialized\n")
    assert len(list(client.events(2_000))) == 1
    assert reported == [Arrival(1_000, line.decode("latin-1"))] == list(client.unknown)


def test_it_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    link = ScriptedLink()
    link.comes(0, b"SB:00\n")
    with caplog.at_level(logging.INFO, "tickrig.host.rrc"):
        RrcClient(link).run_for(0)
    assert [record.getMessage() for record in caplog.records] == ["unknown line 'SB:00'"]


def test_only_the_latest_are_kept() -> None:
    link = ScriptedLink()
    link.comes(0, b"".join(b"XX:%d\n" % n for n in range(1_000)))
    client = RrcClient(link)
    client.run_for(0)
    assert [arrival.value for arrival in client.unknown][-1] == "XX:999"
    assert len(client.unknown) == UNKNOWN_KEPT


def test_noise_without_line_end_does_not_swallow_what_follows_it() -> None:
    link = ScriptedLink()
    link.comes(0, b"x" * 100_000 + b"\nEV:Initialized\n")
    assert len(list(RrcClient(link).events(0 + 1))) == 1


def test_a_bad_status_line_does_not_become_the_latest_status() -> None:
    link = ScriptedLink()
    link.comes(0, b"SA:00000000A10000\nSA:64000000A10000\n")
    client = RrcClient(link)
    client.run_for(0)
    assert client.latest_status is not None
    assert client.latest_status.value.in_v_pct == 0
