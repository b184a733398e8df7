"""SDO transfers and scripts, frame by frame."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canopen.dialogue import (
    FENCES,
    LEAST_COPY_US,
    SDO_TIMEOUT_US,
    AwaitReport,
    AwaitState,
    Dialogue,
    Failure,
    Guard,
    Misnamed,
    NmtRequest,
    Object,
    Pause,
    QueuedScript,
    Script,
    Unanswered,
)
from tickrig.host.canopen.errors import SdoFailed, SdoMisnamed
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.canopen.nmt import NmtCommand, NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

Exchange = tuple[str, str]
"""What is sent, and the answer; an empty one where there is none."""


class Talk:
    """One script with a node, and what came of it."""

    def __init__(
        self, script: Script[Any], on_misnamed: Misnamed | None = None, now_us: int = 0
    ) -> None:
        self.sent: list[str] = []
        self.result: Any = None
        self.failure: Failure | None = None
        self.dialogue = Dialogue(5, self._send, on_misnamed=on_misnamed)
        self.start(now_us, script)

    def start(self, now_us: int, script: Script[Any]) -> None:
        self.dialogue.start(now_us, QueuedScript("test", script, self._done, self._failed))

    def answer(self, now_us: int, text: str) -> None:
        self.dialogue.receive_sdo(now_us, bytes.fromhex(text))

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
    assert talk.dialogue.due_us == 500_000
    talk.dialogue.tick(SDO_TIMEOUT_US - 1)
    assert talk.failure is None
    talk.dialogue.tick(SDO_TIMEOUT_US)
    assert str(talk.failure) == "1000h:00 was not answered"
    assert talk.sent[-1] == "605#8000100000000405"


def reading(times: int) -> Script[list[bytes | str]]:
    """Read 2000h so often; what came of each."""
    found: list[bytes | str] = []
    for _ in range(times):
        try:
            found.append((yield from upload(0x2000, 0)))
        except SdoFailed as error:
            found.append(str(error))
    return found


def late(times: int = 2) -> Talk:
    """A talk in which 2000h was not answered in time, and is to be read again."""
    talk = Talk(reading(times))
    talk.dialogue.tick(SDO_TIMEOUT_US)
    assert talk.sent == [
        *("605#4000200000000000", "605#8000200000000405"),
        "605#4000100000000000",
    ]
    return talk


def test_what_was_not_answered_is_asked_again_when_another_object_was_answered() -> None:
    talk = late()
    talk.answer(600_000, "4300200001000000")
    talk.answer(600_100, "4300100000000000")
    assert talk.sent[3:] == ["605#4000200000000000"]
    talk.answer(600_200, "4300200002000000")
    assert talk.result == ["2000h:00 was not answered", b"\2\0\0\0"]


def test_an_abort_is_an_answer_that_names_its_object() -> None:
    talk = late()
    talk.answer(600_100, "8000100000000206")
    assert talk.sent[3:] == ["605#4000200000000000"]


def test_a_fence_that_comes_in_segments_is_aborted() -> None:
    talk = late()
    talk.answer(600_100, "4100100008000000")
    assert talk.sent[3:] == ["605#8000100000000008", "605#4000200000000000"]


def test_while_a_fence_is_not_answered_the_object_is_not_asked_for() -> None:
    talk = late(4)
    for number in (2, 3, 4):
        talk.dialogue.tick(number * SDO_TIMEOUT_US)
    assert talk.sent[3:] == [
        *("605#8000100000000405", "605#4000100000000000") * 2,
        "605#8000100000000405",
    ]
    assert talk.result == ["2000h:00 was not answered"] * 4


@pytest.mark.parametrize("stray", ["8000000001000405", "0011223344556677", "2000000000000000"])
def test_what_names_no_object_may_answer_what_was_asked_before(stray: str) -> None:
    def script() -> Script[list[bytes | str]]:
        yield from reading(1)
        return [(yield from upload(0x2001, 0))]

    talk = Talk(script())
    talk.dialogue.tick(SDO_TIMEOUT_US)
    talk.answer(600_000, stray)
    assert (talk.result, talk.failure) == (None, None)
    talk.answer(600_100, "4301200002000000")
    assert talk.result == [b"\2\0\0\0"]


def test_a_late_answer_shows_which_earlier_requests_stay_without_an_answer() -> None:
    talk = Talk(steps())
    talk.dialogue.remember((0x2000, 0))
    talk.dialogue.remember((0x2001, 0))
    talk.answer(100, "4301200001000000")
    talk.start(200, upload(0x2000, 0))
    assert talk.sent == ["605#4000200000000000"]


def test_after_an_abort_by_the_host_the_object_is_read_behind_a_fence() -> None:
    talk = Talk(reading(2))
    talk.answer(100, "2000000000000000")
    assert talk.sent[1:] == ["605#8000200000000305", "605#4000100000000000"]


def test_a_repeated_request_counts_once() -> None:
    unanswered = Unanswered()
    for sub in (1, 1, 2, 3, 3, 1):
        unanswered.add((0x2000, sub))
    assert unanswered == [(0x2000, 1), (0x2000, 2), (0x2000, 3), (0x2000, 1)]


def test_fences_are_mandatory_objects_and_the_sub_indices_of_the_first() -> None:
    identity = ((0x1018, sub) for sub in range(5))
    assert FENCES[:7] == ((0x1000, 0), (0x1001, 0), *identity)
    assert FENCES[7:] == tuple((0x1000, sub) for sub in range(1, 255))


@pytest.mark.parametrize("asked", FENCES[:8])
def test_a_fence_is_another_object_than_all_that_were_asked_for_in_vain(asked: Object) -> None:
    unanswered = Unanswered()
    for at in (*FENCES[:8], asked):
        unanswered.add(at)
    fence = unanswered.fence(asked)
    assert fence not in unanswered
    unanswered.add(fence)
    unanswered.hear(fence)
    assert asked not in unanswered


def test_where_all_fences_were_asked_for_in_vain_the_oldest_question_is_forgotten() -> None:
    unanswered, asked = Unanswered(), (0x2000, 0)
    for at in (*FENCES, asked):
        unanswered.add(at)
    assert unanswered.fence(asked) == FENCES[0]
    assert (FENCES[0] in unanswered, FENCES[1] in unanswered) == (False, True)


def test_a_copy_of_an_answer_within_a_transfer_is_ignored() -> None:
    talk = Talk(upload(0x1008, 0))
    for text in ("4108100009000000", "00662D70616C6574", "1B74650000000000"):
        assert talk.result is None
        talk.answer(0, text)
        talk.answer(0, text)
    assert (talk.result, talk.failure) == (b"f-palette", None)


def test_an_object_is_read_again_when_no_copy_of_its_answer_can_come_any_more() -> None:
    talk = Talk(reading(2))
    talk.answer(500, "4300200001000000")
    talk.answer(600, "4300200001000000")
    assert (len(talk.sent), talk.dialogue.due_us) == (1, 500 + LEAST_COPY_US)
    talk.dialogue.tick(talk.dialogue.due_us)
    talk.answer(40_000, "4300200002000000")
    assert talk.result == [b"\1\0\0\0", b"\2\0\0\0"]


def test_a_segment_while_a_copy_may_come_sends_no_request() -> None:
    talk = Talk(reading(2))
    talk.answer(500, "4300200001000000")
    talk.answer(600, "0011223344556677")
    assert (len(talk.sent), talk.dialogue.due_us) == (1, 500 + LEAST_COPY_US)


def test_an_object_is_read_at_once_when_the_time_for_a_copy_is_over() -> None:
    talk = Talk(reading(1))
    talk.answer(500, "4300200001000000")
    talk.start(2_500, reading(1))
    assert len(talk.sent) == 2


@pytest.mark.parametrize(("answer_ms", "due_ms"), [(101, 103), (107, 114), (120, 140), (300, 320)])
def test_a_copy_may_come_as_long_as_the_answer_took_within_limits(
    answer_ms: int, due_ms: int
) -> None:
    talk = Talk(reading(2), now_us=100_000)
    talk.answer(answer_ms * 1_000, "4300200001000000")
    assert talk.dialogue.due_us == due_ms * 1_000


def test_a_job_that_is_forgotten_leaves_its_question_open() -> None:
    talk = Talk(upload(0x2000, 0))
    talk.dialogue.clear()
    talk.start(0, upload(0x2000, 0))
    assert talk.sent == ["605#4000200000000000", "605#4000100000000000"]


def test_jobs_run_one_after_the_other() -> None:
    def pausing() -> Script[None]:
        yield NmtRequest(NmtCommand.START)
        yield Pause(1_000)

    talk = Talk(pausing())
    talk.start(0, download(0x1017, 0, b"\0\0"))
    assert talk.sent == ["000#0105"]
    talk.dialogue.tick(1_000)
    assert talk.sent == ["000#0105", "605#2b17100000000000"]


def test_a_job_from_a_callback_runs_after_those_that_wait() -> None:
    dialogue, ended, running = idle(), list[str](), list[str]()

    def start_third(_: object) -> None:
        dialogue.start(50, job(steps(), ended, "third "))
        running.append(dialogue.job.what if dialogue.job else "")

    dialogue.start(0, QueuedScript("first", steps(Pause(50)), start_third, start_third))
    dialogue.start(0, job(steps(Pause(50)), ended, "second "))
    dialogue.tick(50)
    assert running == ["second "]
    dialogue.tick(100)
    assert ended == ["second done", "third done"]


def test_an_abort_ends_the_transfer_and_drops_all_jobs() -> None:
    talk, ended = Talk(upload(0x2000, 0)), list[str]()
    talk.dialogue.start(0, job(steps(Pause(50)), ended))
    talk.dialogue.abort(AbortCode.GENERAL)
    assert talk.sent[1:] == ["605#8000200000000008"]
    assert (talk.dialogue.job, ended) == (None, ["dropped"])


def test_without_a_transfer_an_abort_sends_nothing() -> None:
    talk = Talk(steps(Pause(50)))
    talk.dialogue.abort(AbortCode.GENERAL)
    assert (talk.sent, talk.dialogue.job) == ([], None)


@given(st.lists(st.binary(max_size=9), max_size=30), st.booleans())
def test_noise_ends_a_transfer_or_leaves_it_waiting(noise: list[bytes], reading: bool) -> None:
    talk = Talk(upload(0x1000, 0) if reading else download(0x2008, 0, bytes(20)))
    for data in noise:
        talk.dialogue.receive_sdo(0, data)
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


def steps(*waits: AwaitState | Pause) -> Script[None]:
    yield from waits


def idle() -> Dialogue:
    return Dialogue(5, lambda can_id, data: None)


def job(
    script: Script[Any], ended: list[str], what: str = "", *, moves: bool = True
) -> QueuedScript:
    """A job that notes how it ended."""

    def note(how: str) -> None:
        ended.append(f"{what}{how}")

    def fail(failure: Failure) -> None:
        note(str(failure))

    return QueuedScript(what, script, lambda _: note("done"), fail, lambda: note("dropped"), moves)


def test_without_a_job_nothing_is_due_and_nothing_moves() -> None:
    dialogue = idle()
    dialogue.tick(NEVER - 1)
    dialogue.clear()
    dialogue.receive_state(0, NmtState.OPERATIONAL)
    dialogue.receive_sdo(0, bytes(8))
    assert (dialogue.due_us, dialogue.job, dialogue.moves) == (NEVER, None, False)


def test_what_is_heard_before_the_first_job_is_passed_over() -> None:
    dialogue = idle()
    dialogue.receive_sdo(0, bytes.fromhex("4300100091010700"))
    dialogue.receive_state(0, NmtState.OPERATIONAL)
    assert (dialogue.job, dialogue.due_us) == (None, NEVER)


def test_a_state_that_is_awaited_ends_the_wait_and_no_other_does() -> None:
    dialogue, ended = idle(), list[str]()
    dialogue.start(0, job(steps(AwaitState(NmtState.OPERATIONAL, 300)), ended))
    dialogue.receive_state(10, NmtState.PRE_OPERATIONAL)
    dialogue.receive_sdo(20, bytes.fromhex("4300100091010700"))
    assert ended == []
    dialogue.receive_state(30, NmtState.OPERATIONAL)
    assert ended == ["done"]
    assert (dialogue.due_us, dialogue.job) == (NEVER, None)


def test_a_state_is_nothing_to_who_awaits_an_answer_or_pauses() -> None:
    for script in (upload(0x1000, 0), steps(Pause(300))):
        dialogue, ended = idle(), list[str]()
        dialogue.start(0, job(script, ended))
        dialogue.receive_state(10, NmtState.OPERATIONAL)
        assert ended == []


def test_a_state_that_does_not_come_in_time_fails() -> None:
    dialogue, ended = idle(), list[str]()
    dialogue.start(1_000, job(steps(AwaitState(NmtState.OPERATIONAL, 300)), ended))
    assert dialogue.due_us == 1_300
    dialogue.tick(1_299)
    assert ended == []
    dialogue.tick(1_300)
    assert ended == ["OPERATIONAL was not reported"]


def test_each_wait_begins_when_the_one_before_has_ended() -> None:
    wait = AwaitState(NmtState.OPERATIONAL, 300)
    dialogue = idle()
    dialogue.start(1_000, job(steps(Pause(50), wait, Pause(70)), []))
    assert dialogue.due_us == 1_050
    dialogue.tick(1_060)
    assert dialogue.due_us == 1_360
    dialogue.receive_state(1_100, NmtState.OPERATIONAL)
    assert dialogue.due_us == 1_170


def test_an_answer_begins_the_next_wait() -> None:
    def reading_on() -> Script[None]:
        yield from upload(0x1000, 0)
        yield Pause(70)

    dialogue = idle()
    dialogue.start(0, job(reading_on(), []))
    dialogue.receive_sdo(100, bytes.fromhex("4300100091010700"))
    assert dialogue.due_us == 170


def test_a_wait_that_is_deferred_lasts_longer() -> None:
    dialogue, ended = idle(), list[str]()
    dialogue.defer(1_000)
    assert dialogue.due_us == NEVER
    dialogue.start(0, job(steps(Pause(50)), ended))
    dialogue.defer(1_000)
    dialogue.tick(1_049)
    assert ended == []
    dialogue.tick(1_050)
    assert ended == ["done"]


def test_all_jobs_that_are_forgotten_are_told_and_closed() -> None:
    closed = list[str]()

    def closing() -> Script[None]:
        try:
            yield Pause(50)
        finally:
            closed.append("closed")

    dialogue, ended = idle(), list[str]()
    script = closing()
    dialogue.start(0, job(script, ended, "first "))
    dialogue.start(0, job(steps(Pause(50)), ended, "second "))
    dialogue.clear()
    assert ended == ["first dropped", "second dropped"]
    assert (closed, dialogue.job, dialogue.due_us) == (["closed"], None, NEVER)
    dialogue.tick(NEVER - 1)
    dialogue.start(0, job(steps(Pause(50)), ended, "third "))
    dialogue.tick(50)
    assert ended == ["first dropped", "second dropped", "third done"]
    assert dialogue.job is None


def test_a_job_moves_the_node_unless_it_says_otherwise() -> None:
    dialogue, ended, moves = idle(), list[str](), list[bool]()
    dialogue.start(0, job(steps(Pause(50)), ended, moves=False))
    moves.append(dialogue.moves)
    dialogue.start(0, QueuedScript("", steps(Pause(50)), ended.append, lambda _: None))
    for now_us in (0, 50, 100):
        dialogue.tick(now_us)
        moves.append(dialogue.moves)
    assert moves == [False, True, True, False]


def report(timeout_us: int, *, boot_up: bool = True) -> Script[NmtState | None]:
    usual = AwaitReport(timeout_us)
    state: NmtState | None = yield usual if boot_up else AwaitReport(timeout_us, boot_up=False)
    return state


@pytest.mark.parametrize("state", NmtState)
def test_any_report_is_given_to_who_awaits_one(state: NmtState) -> None:
    talk = Talk(report(300))
    talk.dialogue.receive_state(10, state)
    assert talk.result is state
    assert talk.dialogue.job is None


def test_a_boot_up_is_no_report_where_it_does_not_count() -> None:
    talk = Talk(report(300, boot_up=False))
    talk.dialogue.receive_state(10, NmtState.INITIALISING)
    assert (talk.dialogue.job is None, talk.dialogue.due_us) == (False, 300)
    talk.dialogue.receive_state(20, NmtState.STOPPED)
    assert talk.result is NmtState.STOPPED


def test_without_a_report_who_awaits_one_is_given_nothing() -> None:
    talk = Talk(report(300))
    talk.result = "not yet"
    talk.dialogue.tick(299)
    assert talk.result == "not yet"
    talk.dialogue.tick(300)
    assert talk.result is None
    assert talk.failure is None


def test_a_guard_request_is_a_remote_frame_and_waits_for_nothing() -> None:
    def guarding() -> Script[None]:
        yield Guard()

    guarded: list[int] = []
    ended: list[str] = []
    dialogue = Dialogue(5, lambda can_id, data: None, guarded.append)
    dialogue.start(0, job(guarding(), ended))
    assert (guarded, ended) == ([0x705], ["done"])
    idle().start(0, job(guarding(), ended))
    assert ended == ["done", "done"]


def test_the_time_out_of_sdo_may_be_another() -> None:
    failures: list[Failure] = []
    dialogue = Dialogue(5, lambda can_id, data: None, sdo_timeout_us=100)
    dialogue.start(0, QueuedScript("", upload(0x1000, 0), failures.append, failures.append))
    assert dialogue.due_us == 100
    dialogue.tick(100)
    assert str(failures[0]) == "1000h:00 was not answered"


ABORT_OF_1000 = bytes.fromhex("8000100000000206")
VALUE_OF_1000 = bytes.fromhex("4300100091010700")


def misnamed_talk() -> tuple[Dialogue, list[object], list[tuple[tuple[int, int], bytes]]]:
    """Ask for 5FFDh in a dialogue that takes answers that name other objects."""
    ended: list[object] = []
    misnamed: list[tuple[tuple[int, int], bytes]] = []
    dialogue = Dialogue(
        5, lambda can_id, data: None, on_misnamed=lambda at, data: misnamed.append((at, data))
    )
    dialogue.start(0, QueuedScript("test", upload(0x5FFD, 0), ended.append, ended.append))
    return dialogue, ended, misnamed


def test_an_abort_that_names_another_object_ends_the_only_question() -> None:
    dialogue, ended, misnamed = misnamed_talk()
    dialogue.receive_sdo(1_000, ABORT_OF_1000)
    dialogue.tick(100_999)
    assert ended == []
    dialogue.tick(101_000)
    assert [str(error) for error in ended] == ["5FFDh:00 aborted: 06020000h NO_OBJECT"]
    assert misnamed == [((0x5FFD, 0), ABORT_OF_1000)]


def test_a_value_that_names_another_object_is_no_value_of_the_one_asked_for() -> None:
    dialogue, ended, misnamed = misnamed_talk()
    dialogue.receive_sdo(1_000, VALUE_OF_1000)
    dialogue.tick(101_000)
    assert [type(error) for error in ended] == [SdoMisnamed]
    assert misnamed == [((0x5FFD, 0), VALUE_OF_1000)]


def test_the_right_answer_counts_behind_one_that_names_another_object() -> None:
    dialogue, ended, misnamed = misnamed_talk()
    dialogue.receive_sdo(1_000, ABORT_OF_1000)
    dialogue.receive_sdo(90_000, bytes.fromhex("43FD5F0001020304"))
    assert (ended, misnamed) == ([b"\1\2\3\4"], [])


def test_an_abort_that_names_another_object_is_ignored_while_others_are_open() -> None:
    dialogue, ended, misnamed = misnamed_talk()
    dialogue.remember((0x2000, 0))
    dialogue.receive_sdo(1_000, ABORT_OF_1000)
    dialogue.tick(101_000)
    assert ended == []
    dialogue.tick(500_000)
    assert [type(error) for error in ended] == [SdoMisnamed]
    assert misnamed == [((0x5FFD, 0), ABORT_OF_1000)]


def test_a_value_that_names_another_object_aborts_the_transfer() -> None:
    talk = Talk(upload(0x5FFD, 0), lambda at, data: None)
    talk.dialogue.receive_sdo(1_000, VALUE_OF_1000)
    talk.dialogue.tick(101_000)
    assert talk.sent[1:] == ["605#80fd5f0000000008"]


def test_after_an_answer_that_names_another_object_the_right_one_is_read_at_once() -> None:
    talk = Talk(reading(2), lambda at, data: None)
    talk.dialogue.receive_sdo(1_000, ABORT_OF_1000)
    talk.dialogue.tick(101_000)
    assert talk.sent == ["605#4000200000000000"] * 2
    talk.answer(102_000, "4300200002000000")
    assert talk.result == ["2000h:00 aborted: 06020000h NO_OBJECT", b"\2\0\0\0"]


def test_an_answer_that_names_another_object_does_not_count_for_the_next_request() -> None:
    talk = Talk(reading(2), lambda at, data: None)
    talk.dialogue.receive_sdo(1_000, ABORT_OF_1000)
    talk.answer(1_500, "4300200001000000")
    talk.dialogue.tick(talk.dialogue.due_us)
    talk.dialogue.tick(talk.dialogue.due_us)
    assert talk.result == [b"\1\0\0\0", "2000h:00 was not answered"]


def test_an_answer_that_does_not_name_the_fence_is_one_to_the_fence() -> None:
    misnamed: list[tuple[Object, bytes]] = []
    talk = Talk(reading(2), lambda at, data: misnamed.append((at, data)))
    talk.dialogue.tick(SDO_TIMEOUT_US)
    value_of_2001 = bytes.fromhex("4301200001000000")
    talk.dialogue.receive_sdo(600_000, value_of_2001)
    talk.dialogue.tick(2 * SDO_TIMEOUT_US)
    assert misnamed == [((0x1000, 0), value_of_2001)]
