"""What each callback of the proxy asks for, and what it returns for each status."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.device.rtc_lite.bench import Recorder
from tests.host.rtc.lite.bench import Bench
from tests.host.rtc.lite.scripted_node import ScriptedNode
from tickrig.host.rtc import ExecutionContext, OutPort, ReturnCode, connect
from tickrig.host.rtc.lite import RtcLiteProxy
from tickrig.wire.rtc_lite.codes import LiteCommand, LiteLinkFault
from tickrig.wire.rtc_lite.frame import LiteFrame, fault_frame
from tickrig.wire.rtc_types.rtc import Time, TimedLong

OK, ERROR = ReturnCode.RTC_OK, ReturnCode.RTC_ERROR
BAD, UNSUPPORTED = ReturnCode.BAD_PARAMETER, ReturnCode.UNSUPPORTED
PRECONDITION = ReturnCode.PRECONDITION_NOT_MET
EC = ExecutionContext()

CODES = {
    b"@": OK,
    b"x": ERROR,
    b"H": PRECONDITION,
    b"F": BAD,
    b"D": BAD,
    b"I": ERROR,
    b"!": UNSUPPORTED,
    b"?": ERROR,
    b"": ERROR,
    b"fault": ERROR,
}
"""What a callback returns for a status; an empty one is no reply at all."""

REFUSED = dict.fromkeys(CODES, ERROR) | {b"@": OK}
OPTIONAL = CODES | {b"!": OK}


class Row:
    """A callback, and where it is called.

    Attributes:
        state: of proxy and device.
        command: what the callback asks the device for.
        good: state in the reply, if the command has one in it.
        codes: what it returns for each status.
    """

    def __init__(
        self,
        call: Callable[[RtcLiteProxy], ReturnCode],
        state: str,
        command: LiteCommand,
        good: bytes,
        codes: dict[bytes, ReturnCode] = CODES,
    ) -> None:
        self.call, self.state, self.command = call, state, command
        self.good, self.codes = good, codes


ROWS = {
    "on_initialize": Row(
        RtcLiteProxy.on_initialize, "Created", LiteCommand.INITIALIZE, b"I", REFUSED
    ),
    "on_startup": Row(lambda p: p.on_startup(EC), "Inactive", LiteCommand.STARTUP, b"I", OPTIONAL),
    "on_shutdown": Row(
        lambda p: p.on_shutdown(EC), "Inactive", LiteCommand.SHUTDOWN, b"I", OPTIONAL
    ),
    "on_activated": Row(lambda p: p.on_activated(EC), "Inactive", LiteCommand.ACTIVATE, b"A"),
    "on_execute": Row(lambda p: p.on_execute(EC), "Active", LiteCommand.EXECUTE, b"A"),
    "on_execute with data": Row(
        lambda p: written(p).on_execute(EC), "Active", LiteCommand.WRITE, b""
    ),
    "on_deactivated": Row(lambda p: p.on_deactivated(EC), "Active", LiteCommand.DEACTIVATE, b"I"),
    "on_aborting": Row(lambda p: p.on_aborting(EC), "Active", LiteCommand.ABORT, b"E"),
    "on_error": Row(lambda p: p.on_error(EC), "Error", LiteCommand.ERROR, b"E"),
    "on_reset": Row(lambda p: p.on_reset(EC), "Error", LiteCommand.RESET, b"I", REFUSED),
    "on_finalize": Row(RtcLiteProxy.on_finalize, "Inactive", LiteCommand.FINALIZE, b"N"),
}


def made(state: str) -> tuple[RtcLiteProxy, ScriptedNode]:
    """A proxy and its node, both in a state."""
    link = ScriptedNode()
    proxy = RtcLiteProxy("Echo0", link)
    if state != "Created":
        assert proxy.on_initialize() is OK
    if state in {"Active", "Error"}:
        assert proxy.on_activated(EC) is OK
    if state == "Error":
        assert proxy.on_aborting(EC) is OK
    link.taken()
    return proxy, link


def written(proxy: RtcLiteProxy) -> RtcLiteProxy:
    """Write 42 to the InPort of a proxy."""
    out = OutPort("out", TimedLong)
    connect(out, proxy.ports["in"])
    out.write(TimedLong(Time(), 42))
    return proxy


def answer(row: Row, status: bytes) -> list[LiteFrame]:
    """Make up the reply of a device."""
    if status == b"fault":
        return [fault_frame(LiteLinkFault.CHECKSUM)]
    if not status:
        return []
    fields = row.good if status == b"@" else b"E" if row.good and status in {b"x", b"H"} else b""
    return [LiteFrame(row.command, status + fields)]


@pytest.mark.parametrize("status", CODES)
@pytest.mark.parametrize("name", ROWS)
def test_a_callback_returns_what_its_row_says(name: str, status: bytes) -> None:
    row = ROWS[name]
    proxy, link = made(row.state)
    link.answers[row.command] = answer(row, status)
    assert row.call(proxy) is row.codes[status]
    assert row.command.value.decode() in link.taken()


@pytest.mark.parametrize("name", [name for name in ROWS if name != "on_initialize"])
def test_in_doubt_a_callback_sends_nothing_and_fails(name: str) -> None:
    row = ROWS[name]
    proxy, link = made(row.state)
    link.answers[LiteCommand.STARTUP] = link.answers[LiteCommand.PING] = []
    assert proxy.on_startup(EC) is ERROR
    assert link.taken() == ["AS", "CY"]
    code = row.call(proxy)
    assert code is ERROR or name in {"on_aborting", "on_error"}
    assert link.taken() == []


def test_an_answered_ping_ends_the_doubt() -> None:
    proxy, link = made("Active")
    link.answers[LiteCommand.EXECUTE] = []
    assert proxy.on_execute(EC) is ERROR
    proxy.tick()
    del link.answers[LiteCommand.EXECUTE]
    assert proxy.on_execute(EC) is OK
    assert link.taken() == ["AE", "CY", "AE"]


def test_a_callback_waits_for_a_ping_that_is_under_way() -> None:
    proxy, link = made("Inactive")
    link.now_us = proxy.due_us
    proxy.tick()
    assert proxy.on_activated(EC) is OK
    assert link.taken() == ["CY", "AA"]


def test_a_callback_goes_on_when_a_single_ping_was_lost() -> None:
    proxy, link = made("Inactive")
    due_us = link.now_us = proxy.due_us
    link.answers[LiteCommand.PING] = []
    proxy.tick()
    requested_us = link.now_us
    assert proxy.on_activated(EC) is OK
    assert link.taken() == ["CY", "AA"]
    assert 100_000 <= link.now_us - requested_us <= 102_000
    assert proxy.due_us == due_us + 1_000_000


def test_a_ping_that_has_fallen_due_goes_before_the_next_request() -> None:
    proxy, link = made("Active")
    due_us = proxy.due_us
    link.now_us = due_us - 500
    assert proxy.on_execute(EC) is OK  # the reply comes when the PING is due already
    assert proxy.on_execute(EC) is OK
    assert link.taken() == ["AE", "CY", "AE"]
    proxy.tick()
    assert proxy.due_us == due_us + 1_000_000


def test_an_unanswered_ping_counts_when_the_request_after_it_is_not_answered_either() -> None:
    proxy, link = made("Active")
    link.answers = {LiteCommand.PING: [], LiteCommand.EXECUTE: []}
    link.now_us = proxy.due_us
    proxy.tick()
    assert proxy.on_execute(EC) is ERROR
    while proxy.fatal_us is None:
        link.now_us = proxy.due_us
        proxy.tick()
    assert link.taken() == ["CY", "AE", "CY", "CY", "CY"]
    assert (proxy.pings.sent, proxy.pings.answered, proxy.pings.lost) == (4, 0, 4)


def test_a_late_reply_is_not_taken_for_that_of_the_next_request() -> None:
    proxy, link = made("Active")
    link.answers[LiteCommand.EXECUTE] = []
    assert proxy.on_execute(EC) is ERROR
    link.come(LiteFrame(LiteCommand.EXECUTE, b"@A"))
    proxy.tick()
    assert proxy.on_execute(EC) is ERROR


@pytest.mark.parametrize(
    ("state", "asked", "code"),
    [
        (b"C", ["AC", "CI"], OK),
        (b"I", ["AC"], OK),
        (b"A", ["AC", "AB", "AR"], ERROR),
        (b"N", ["AC"], ERROR),
        (b"?", ["AC", "CX"], ERROR),
    ],
)
def test_a_reset_begins_from_where_the_device_is(
    state: bytes, asked: list[str], code: ReturnCode
) -> None:
    proxy, link = made("Error")
    link.answers = {
        LiteCommand.ERROR: [LiteFrame(LiteCommand.ERROR, b"H" + state)],
        LiteCommand.STATE: [LiteFrame(LiteCommand.STATE, b"@" + state)],
        LiteCommand.INITIALIZE: [LiteFrame(LiteCommand.INITIALIZE, b"@I")],
        LiteCommand.ABORT: [LiteFrame(LiteCommand.ABORT, b"@E")],
        LiteCommand.RESET: [LiteFrame(LiteCommand.RESET, b"xE")],
    }
    assert proxy.on_error(EC) is PRECONDITION
    assert proxy.on_reset(EC) is code
    assert link.taken() == asked


def test_a_device_that_did_not_follow_into_error_is_aborted_in_the_next_period() -> None:
    proxy, link = made("Active")
    link.answers[LiteCommand.ABORT] = []
    assert proxy.on_aborting(EC) is ERROR
    proxy.tick()
    del link.answers[LiteCommand.ABORT]
    link.taken()
    assert proxy.on_error(EC) is OK
    assert link.taken() == ["CX", "AB", "AC"]
    assert link.recorder.called[-3:] == ["on_deactivated", "on_aborting", "on_error"]


def test_a_rate_is_none_of_the_business_of_a_device_that_is_told_to_execute() -> None:
    proxy, link = made("Active")
    assert proxy.on_rate_changed(EC) is OK
    assert link.taken() == []


def test_a_line_that_goes_while_a_ping_is_under_way_is_not_waited_for() -> None:
    bench = Bench(Recorder)
    proxy = bench.attach(0, "Echo")
    bench.rig.run_to(proxy.due_us)
    proxy.tick()
    bench.links[0].close()
    assert proxy.on_activated(EC) is ERROR
