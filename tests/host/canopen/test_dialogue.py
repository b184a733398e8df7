"""SDO transfers and scripts, frame by frame."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canopen.dialogue import Dialogue, Failure, Job
from tickrig.host.canopen.script import SDO_TIMEOUT_US, Command, Pause, Script
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.canopen.nmt import NmtCommand

Exchange = tuple[str, str]
"""What is sent, and the answer; an empty one where there is none."""


class Talk:
    """One script with a node, and what came of it."""

    def __init__(self, script: Script[Any]) -> None:
        self.sent: list[str] = []
        self.result: Any = None
        self.failure: Failure | None = None
        self.dialogue = Dialogue(
            5, lambda can_id, data: self.sent.append(f"{can_id:03X}#{data.hex()}")
        )
        self.dialogue.start(0, Job("test", script, self._done, self._failed))

    def answer(self, now_us: int, text: str) -> None:
        self.dialogue.hear_sdo(now_us, bytes.fromhex(text))

    def _send(self, can_id: int, data: bytes) -> None:
        self.sent.append(f"{can_id:03X}#{data.hex()}")

    def _done(self, result: Any) -> None:
        self.result = result

    def _failed(self, failure: Failure) -> None:
        self.failure = failure


def played(script: Script[Any], *exchanges: Exchange) -> Talk:
    talk = Talk(script)
    for number, (request, answer) in enumerate(exchanges):
        assert talk.sent[-1] == f"605#{request}"
        if answer:
            talk.answer(number, answer)
    assert talk.dialogue.job is None
    return talk


def test_up_to_four_bytes_are_read_at_once() -> None:
    talk = played(upload(0x1000, 0), ("4000100000000000", "4300100091010700"))
    assert talk.result == bytes.fromhex("91010700")


def test_longer_values_are_read_in_segments() -> None:
    talk = played(
        upload(0x1008, 0),
        ("4008100000000000", "4108100009000000"),
        ("6000000000000000", "00662D70616C6574"),
        ("7000000000000000", "1B74650000000000"),
    )
    assert talk.result == b"f-palette"


def test_up_to_four_bytes_are_written_at_once() -> None:
    talk = played(download(0x1017, 0, b"\x64\0"), ("2b17100064000000", "6017100000000000"))
    assert (talk.result, talk.failure) == (None, None)


@pytest.mark.parametrize(
    ("data", "exchanges"),
    [
        (b"", [("2108200000000000", "6008200000000000"), ("0f00000000000000", "2000000000000000")]),
        (
            b"f-palette",
            [
                ("2108200009000000", "6008200000000000"),
                ("00662d70616c6574", "2000000000000000"),
                ("1b74650000000000", "3000000000000000"),
            ],
        ),
    ],
)
def test_other_values_are_written_in_segments(data: bytes, exchanges: list[Exchange]) -> None:
    talk = played(download(0x2008, 0, data), *exchanges)
    assert talk.failure is None


@pytest.mark.parametrize(
    ("script", "exchanges", "reason"),
    [
        (
            upload(0x1000, 1),
            [("4000100100000000", "8000100111000906")],
            "1000h:01 aborted: 06090011h NO_SUBINDEX",
        ),
        (
            upload(0x1000, 0),
            [("4000100000000000", "8000100042424242")],
            "1000h:00 aborted: 42424242h unknown",
        ),
        (
            upload(0x1000, 0),
            [("4000100000000000", "2000000000000000"), ("8000100000000305", "")],
            "1000h:00 aborted: 05030000h TOGGLE_BIT",
        ),
        (
            upload(0x1008, 0),
            [
                ("4008100000000000", "4108100009000000"),
                ("6000000000000000", "10662D70616C6574"),
                ("8008100000000305", ""),
            ],
            "1008h:00 aborted: 05030000h TOGGLE_BIT",
        ),
        (
            download(0x1000, 0, b"\0"),
            [("2f00100000000000", "A000000000000000"), ("8000100001000405", "")],
            "1000h:00 aborted: 05040001h COMMAND_SPECIFIER",
        ),
        (
            download(0x2008, 0, b"12345"),
            [
                ("2108200005000000", "6008200000000000"),
                ("0531323334350000", "3000000000000000"),
                ("8008200000000305", ""),
            ],
            "2008h:00 aborted: 05030000h TOGGLE_BIT",
        ),
    ],
)
def test_a_transfer_that_fails_says_why(
    script: Script[Any], exchanges: list[Exchange], reason: str
) -> None:
    assert str(played(script, *exchanges).failure) == reason


def test_an_answer_that_comes_too_late_for_the_one_before_is_passed_over() -> None:
    talk = Talk(upload(0x1000, 0))
    talk.answer(1, "4318100100000000")
    talk.answer(2, "6017100000000000")
    talk.answer(3, "FF00000000000000")
    talk.answer(4, "00")
    assert talk.dialogue.job is not None
    talk.answer(5, "4300100091010700")
    assert talk.result == bytes.fromhex("91010700")


def test_without_an_answer_the_transfer_is_aborted() -> None:
    talk = Talk(upload(0x1000, 0))
    assert talk.dialogue.due_us == SDO_TIMEOUT_US
    talk.dialogue.tick(SDO_TIMEOUT_US - 1)
    assert talk.failure is None
    talk.dialogue.tick(SDO_TIMEOUT_US)
    assert str(talk.failure) == "1000h:00 was not answered"
    assert talk.sent[-1] == "605#8000100000000405"


def test_jobs_run_one_after_the_other() -> None:
    def pausing() -> Script[None]:
        yield Command(NmtCommand.START)
        yield Pause(1_000)

    talk = Talk(pausing())
    talk.dialogue.start(0, Job("second", download(0x1017, 0, b"\0\0"), talk._done, talk._failed))
    assert talk.sent == ["000#0105"]
    talk.dialogue.tick(1_000)
    assert talk.sent == ["000#0105", "605#2b17100000000000"]


@given(st.lists(st.binary(max_size=9), max_size=30), st.booleans())
def test_noise_ends_a_transfer_or_leaves_it_waiting(noise: list[bytes], reading: bool) -> None:
    talk = Talk(upload(0x1000, 0) if reading else download(0x2008, 0, bytes(20)))
    for data in noise:
        talk.dialogue.hear_sdo(0, data)
    if talk.dialogue.job is not None:
        talk.dialogue.tick(SDO_TIMEOUT_US)
    assert talk.dialogue.job is None


def test_an_abort_of_another_object_comes_too_late_and_is_passed_over() -> None:
    talk = Talk(upload(0x1000, 0))
    talk.answer(1, "8018100400000005")
    assert talk.failure is None
    talk.answer(2, "4300100091010700")
    assert talk.result == bytes.fromhex("91010700")


def test_an_abort_of_no_object_ends_what_is_under_way() -> None:
    talk = Talk(upload(0x1000, 0))
    talk.answer(1, "8000000001000405")
    assert str(talk.failure).startswith("1000h:00")
