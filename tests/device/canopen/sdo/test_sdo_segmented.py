from __future__ import annotations

import pytest

from tests.device.canopen.sdo_client import Client, booted, pattern
from tests.device.canopen.slave_bench import Bus
from tickrig.wire.canopen.sdo import Abort, DownloadSegmentResponse
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER

READ_STATUS = "605#4001100000000000"
STATUS = ["585#4F01100000000000"]


def dialogue(bus: Bus, *lines: tuple[str, str]) -> None:
    """Each line is a request and its answer, empty for none."""
    for request, answer in lines:
        want = [f"585#{answer}"] if answer else []
        assert bus.step(f"605#{request}") == want, request


def test_an_upload_goes_in_segments_with_alternating_toggle() -> None:
    dialogue(
        booted(),
        ("4008100000000000", "410810000F000000"),  # US-01
        ("6000000000000000", "007265666572656E"),
        ("7000000000000000", "10636520736C6176"),
        ("6000000000000000", "0D65000000000000"),
        ("7000000000000000", "8000000001000405"),  # US-05
    )


def test_an_empty_value_is_one_empty_segment() -> None:
    dialogue(
        booted(),
        ("4008200000000000", "4108200000000000"),
        ("6000000000000000", "0F00000000000000"),
        ("7000000000000000", "8000000001000405"),
    )


def test_a_full_segment_can_be_the_last() -> None:
    bus = booted()
    bus.slave.dictionary[0x2007, 0].value = "7 bytes"
    dialogue(
        bus,
        ("4007200000000000", "4107200007000000"),
        ("6000000000000000", "0137206279746573"),
    )


def test_after_the_last_segment_of_a_download_no_transfer_runs() -> None:
    bus = booted()
    dialogue(
        bus,
        ("2107200005000000", "6007200000000000"),
        ("0561626364650000", "2000000000000000"),
        ("1561626364650000", "8000000001000405"),
    )
    assert bus.run(6_000) == []


def test_each_segment_restarts_the_time_out() -> None:
    bus = booted()
    bus.step("605#2107200010000000")
    for number in range(2):
        assert bus.run(3_000) == []
        bus.step(f"605#{16 * number:02X}61626364656667")
    assert bus.run(4_999) == []
    assert bus.step() == ["585#8007200000000405"]


def test_after_a_time_out_nothing_is_due() -> None:
    bus = booted()
    bus.step("605#2107200010000000")
    assert bus.run(5_000) == ["585#8007200000000405"]
    assert bus.slave.due_us == NEVER


def test_a_transfer_of_before_a_reset_delays_no_time_out_after_it() -> None:
    bus = booted()
    bus.step("605#2107200010000000")
    bus.run(1_000)
    assert bus.step("000#8105") == ["705#00"]
    bus.step("605#2107200010000000")
    assert bus.run(4_999) == []
    assert bus.step() == ["585#8007200000000405"]
    assert bus.run(5_000) == []


@pytest.mark.parametrize("request_", ["6000000000000000", "7000000000000000", "0000000000000000"])
def test_a_segment_without_a_transfer_is_aborted(request_: str) -> None:
    dialogue(booted(), (request_, "8000000001000405"))  # US-04, DS-09


@pytest.mark.parametrize(
    "request_",
    [f"{command}00000000000000" for command in ("E0", "A1", "A2", "A3", "C1", "81")],
)
def test_an_unknown_or_misplaced_command_is_aborted(request_: str) -> None:
    dialogue(booted(), (request_, "8000000001000405"))  # SG-01


@pytest.mark.parametrize(
    ("begin", "begun", "wrong"),
    [
        ("4008100000000000", "410810000F000000", "0000000000000000"),
        ("4008100000000000", "410810000F000000", "E000000000000000"),
        ("2107200010000000", "6007200000000000", "6000000000000000"),
        ("2107200010000000", "6007200000000000", "A300000000000000"),
        ("A40810007F000000", "C60810000F000000", "6000000000000000"),
        ("A40810007F000000", "C60810000F000000", "A2007F0000000000"),
    ],
)
def test_what_does_not_go_on_with_a_transfer_aborts_it(begin: str, begun: str, wrong: str) -> None:
    at = begun[2:8]
    dialogue(
        booted(),
        (begin, begun),
        (wrong, f"80{at}01000405"),
        ("6000000000000000", "8000000001000405"),
    )


def test_a_wrong_toggle_aborts_an_upload() -> None:
    dialogue(
        booted(),
        ("4008100000000000", "410810000F000000"),  # US-03
        ("7000000000000000", "8008100000000305"),
    )
    dialogue(
        booted(),
        ("4008100000000000", "410810000F000000"),
        ("6000000000000000", "007265666572656E"),
        ("6000000000000000", "8008100000000305"),
    )


def test_a_client_abort_is_silent_and_the_next_request_is_served() -> None:
    for begin in ("4008100000000000", "2107200010000000", "A40810007F000000", "C60720001E000000"):
        bus = booted()
        assert len(bus.step(f"605#{begin}")) == 1
        assert bus.step("605#8008100000000008") + bus.run(30) == []  # US-06, DS-10, BD-09, BU-12
        assert bus.step(READ_STATUS) == STATUS
        assert bus.run(6_000) == []


def test_a_client_abort_without_a_transfer_is_silent() -> None:
    dialogue(booted(), ("8008100000000008", ""), ("4001100000000000", "4F01100000000000"))


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "begin", ["4008100000000000", "2107200010000000", "A40810007F000000", "C60720001E000000"]
)
def test_a_silent_client_is_aborted_after_5_s(begin: str) -> None:
    bus = booted()
    bus.step(f"605#{begin}")
    assert bus.run(4_999) == []
    multiplexer = begin[2:8]
    assert bus.step() == [f"585#80{multiplexer}00000405"]  # US-08
    assert bus.run(10_000) == []
    assert bus.step(READ_STATUS) == STATUS


def test_every_request_begins_the_5_s_anew() -> None:
    bus = booted()
    bus.step("605#4008100000000000")
    assert bus.run(4_998) == []
    assert bus.step("605#6000000000000000") == ["585#007265666572656E"]
    assert bus.run(4_998) == []
    assert bus.step("605#7000000000000000") == ["585#10636520736C6176"]


def test_a_value_that_is_written_at_once_ends_a_running_transfer() -> None:
    bus = booted()
    assert bus.step("605#4003200000000000") == ["585#4103200008000000"]
    assert bus.step("605#2F002000A5000000") == ["585#6000200000000000"]
    assert bus.step("605#6000000000000000") == ["585#8000000001000405"]


def test_a_new_request_ends_a_running_transfer() -> None:
    dialogue(
        booted(),
        ("2107200010000000", "6007200000000000"),
        ("4008100000000000", "410810000F000000"),
        ("6000000000000000", "007265666572656E"),
        ("4001100000000000", "4F01100000000000"),
        ("7000000000000000", "8000000001000405"),
        ("4007200000000000", "4107200005000000"),
    )


def test_the_value_of_an_upload_is_that_of_its_begin() -> None:
    bus = booted()
    bus.step("605#4007200000000000")
    bus.slave.dictionary[0x2007, 0].value = "other"
    assert bus.step("605#6000000000000000") == ["585#0573686F72740000"]


def test_a_number_may_be_downloaded_in_a_segment() -> None:
    bus = booted()
    dialogue(bus, ("2117100002000000", "6017100000000000"), ("0B64000000000000", "20" + "0" * 14))
    assert bus.run(100)[-1:] == ["705#7F"]  # DS-01


def test_a_download_needs_no_size() -> None:
    dialogue(
        booted(),
        ("2007200000000000", "6007200000000000"),  # DS-03
        ("0973697800000000", "2000000000000000"),
        ("4007200000000000", "4707200073697800"),
    )


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        ([("107369787465656E", "")], AbortCode.TOGGLE_BIT),  # DS-04
        ([("007369787465656E", "20"), ("0020627974652073", "")], AbortCode.TOGGLE_BIT),  # DS-05
        ([("017369787465656E", "")], AbortCode.TOO_SHORT),  # DS-07
        (
            [("007369787465656E", "20"), ("1020627974652073", "30"), ("0020627974652073", "")],
            AbortCode.TOO_LONG,  # DS-06
        ),
    ],
)
def test_a_download_that_fails_changes_nothing(
    lines: list[tuple[str, str]], code: AbortCode
) -> None:
    bus = booted()
    dialogue(bus, ("2107200010000000", "6007200000000000"))
    for request, answer in lines[:-1]:
        dialogue(bus, (request, f"{answer:0<16}"))
    abort = "80072000" + code.to_bytes(4, "little").hex().upper()
    dialogue(bus, (lines[-1][0], abort), ("0000000000000000", "8000000001000405"))
    assert bus.slave.dictionary[0x2007, 0].value == "short"


@pytest.mark.parametrize(
    ("begin", "answer"),
    [
        ("2100100004000000", "8000100002000106"),  # DS-08
        ("2000100000000000", "8000100002000106"),
        ("21FF3F0004000000", "80FF3F0000000206"),
        ("2101200001000000", "8001200013000706"),
        ("2101200003000000", "8001200012000706"),
        ("2107200041000000", "8007200012000706"),
    ],
)
def test_a_download_is_refused_at_its_begin(begin: str, answer: str) -> None:
    dialogue(booted(), (begin, answer), ("0000000000000000", "8000000001000405"))


def test_an_object_that_cannot_hold_so_much_stops_a_download_without_a_size() -> None:
    bus = booted()
    answer = Client(bus).download(0x2007, pattern(65), sized=False)
    assert answer == Abort(0x2007, 0, AbortCode.TOO_LONG)
    answer = Client(bus).download(0x2001, b"\0", sized=False)
    assert answer == Abort(0x2001, 0, AbortCode.TOO_SHORT)
    answer = Client(bus).download(0x2006, b"\x21", sized=False)
    assert answer == Abort(0x2006, 0, AbortCode.VALUE_TOO_HIGH)
    assert bus.slave.dictionary[0x2007, 0].value == "short"


@pytest.mark.unmeasured
@pytest.mark.parametrize("size", [*range(30), 889, 890, 10_000, 20_000])
@pytest.mark.parametrize("sized", [True, False])
def test_every_size_goes_there_and_back(size: int, sized: bool) -> None:
    client, data = Client(booted()), pattern(size)
    answer = client.download(0x2008, data, sized=sized)
    assert isinstance(answer, DownloadSegmentResponse)
    assert client.upload(0x2008) == data


def test_the_object_changes_with_the_last_segment_and_not_before() -> None:
    bus = booted()
    entry = bus.slave.dictionary[0x2007, 0]
    seen: list[bytes] = []
    entry.watch(lambda entry: seen.append(entry.data))
    Client(bus).download(0x2007, b"fifteen letters")
    assert seen == [b"fifteen letters"]
