from __future__ import annotations

from typing import Any

import pytest
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from tests.emulators.sim_bench import SimBench
from tests.host.canmon.model.decode.traces import decode, last, transfers
from tickrig.host.canmon.model.decode.decoded import (
    Transfer,
    TransferDirection,
    TransferMode,
    TransferOutcome,
)
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.wire.can import CanFrame, ErrorFrame

BLOB = bytes(index * 7 % 251 for index in range(2_000))
STRING = b"a text of some length, in segments"


class Listener:
    """Decodes what passes between the canopen library and our slave."""

    def __init__(self) -> None:
        self.bench = SimBench()
        self.node = self.bench.master()
        self.bench.network.run_for(10_000)
        self.decoder = Decoder()
        self.found: list[Transfer] = []
        self.lose = frozenset[int]()
        self._count = 0
        self.bench.wire.observers.append(self._receive)

    def _receive(self, at_us: int, frame: CanFrame | ErrorFrame) -> None:
        self._count += 1
        if self._count not in self.lose:
            self.found += self.decoder.take(Record(at_us, "can0", frame)).transfers


@pytest.fixture
def listener() -> Listener:
    return Listener()


def test_an_expedited_transfer_is_one_value(listener: Listener) -> None:
    listener.node.sdo[0x2002].raw = 0x1234_5678
    assert listener.node.sdo[0x2002].raw == 0x1234_5678
    written, read = listener.found
    assert (written.direction, read.direction) == (
        TransferDirection.DOWNLOAD,
        TransferDirection.UPLOAD,
    )
    assert (written.mode, written.entry, written.value) == (
        TransferMode.EXPEDITED,
        (0x2002, 0),
        0x1234_5678,
    )
    assert read.data == written.data
    assert 0 < read.duration_us < 2_000


def test_a_segmented_transfer_is_one_value(listener: Listener) -> None:
    listener.node.sdo.download(0x2007, 0, STRING)
    assert listener.node.sdo.upload(0x2007, 0) == STRING
    assert [t.mode for t in listener.found] == [TransferMode.SEGMENTED, TransferMode.SEGMENTED]
    assert [t.data for t in listener.found] == [STRING, STRING]


@pytest.mark.parametrize("crc", [False, True])
def test_a_block_transfer_is_one_value(listener: Listener, crc: bool) -> None:
    with listener.node.sdo.open(
        0x2008, 0, "wb", size=len(BLOB), block_transfer=True, request_crc_support=crc
    ) as stream:
        stream.write(BLOB)
    with listener.node.sdo.open(
        0x2008, 0, "rb", block_transfer=True, request_crc_support=crc
    ) as stream:
        assert stream.read() == BLOB
    listener.bench.network.run_for(5_000)
    assert [t.mode for t in listener.found] == [TransferMode.BLOCK, TransferMode.BLOCK]
    assert [t.data for t in listener.found] == [BLOB, BLOB]
    assert [t.flaws for t in listener.found] == [(), ()]


def test_a_block_transfer_over_a_bad_line_is_one_value_with_segments_sent_again(
    listener: Listener,
) -> None:
    listener.node.sdo[0x2008].raw = BLOB
    listener.bench.wire.faults.arm("drop", "0.01")
    with listener.node.sdo.open(0x2008, 0, "rb", block_transfer=True) as stream:
        assert stream.read() == BLOB
    listener.bench.wire.faults.clear("drop")
    listener.bench.network.run_for(5_000)
    found = listener.found[-1]
    assert (found.mode, found.data, found.outcome) == (
        TransferMode.BLOCK,
        BLOB,
        TransferOutcome.DONE,
    )
    assert found.retries > 0


def test_segments_that_the_monitor_missed_are_a_flaw(listener: Listener) -> None:
    listener.lose = frozenset({10})
    with listener.node.sdo.open(0x2008, 0, "wb", size=len(BLOB), block_transfer=True) as stream:
        stream.write(BLOB)
    (found,) = listener.found
    assert "segments missing" in found.flaws
    assert not last("705#00").transfers


def test_a_refusal_carries_its_abort_code(listener: Listener) -> None:
    with pytest.raises(SdoAbortedError):
        listener.node.sdo.upload(0x5000, 0)
    (found,) = listener.found
    assert (found.outcome, found.abort_code) == (TransferOutcome.ABORTED, 0x0602_0000)
    assert not found.by_client
    assert "aborted by server: object does not exist (06020000h)" in str(found)


def test_an_abort_of_the_client_is_told_as_such() -> None:
    (found,) = transfers("605#4000100000000000 605#8000100000000405")
    assert (found.outcome, found.by_client) == (TransferOutcome.ABORTED, True)


@pytest.mark.parametrize(
    ("begun", "mode"),
    [
        ("605#2B171000C8000000", TransferMode.EXPEDITED),
        ("605#2117100014000000 585#6017100000000000 605#0001020304050607", TransferMode.SEGMENTED),
        ("605#C217100014000000 585#A01710000A000000 605#0101020304050607", TransferMode.BLOCK),
    ],
)
def test_an_abort_that_names_no_object_ends_the_transfer_that_runs(
    begun: str, mode: TransferMode
) -> None:
    (found,) = transfers(f"{begun} 605#8000000000000405")
    assert (found.direction, found.entry, found.mode) == (
        TransferDirection.DOWNLOAD,
        (0x1017, 0),
        mode,
    )
    assert (found.outcome, found.by_client, found.partial) == (TransferOutcome.ABORTED, True, False)
    assert last(f"{begun} 605#8000000000000405").entry == (0x1017, 0)


def test_a_time_out_of_the_canopen_library_ends_its_transfer(listener: Listener) -> None:
    silent: Any = listener.bench.network.add_node(9, listener.node.object_dictionary)
    with pytest.raises(SdoCommunicationError):
        silent.sdo.download(0x2002, 0, bytes(4))
    listener.bench.network.run_for(1_000)
    (found,) = listener.found
    assert (found.direction, found.entry) == (TransferDirection.DOWNLOAD, (0x2002, 0))
    assert "aborted by client: SDO protocol timed out" in str(found)


def test_an_abort_of_nothing_that_was_heard_is_of_an_unknown_object() -> None:
    (found,) = transfers("605#8000000000000405")
    assert found.entry is None
    assert str(found).startswith("transfer of an unknown object (aborted by client: ")


def test_an_abort_of_another_object_leaves_the_transfer_that_runs() -> None:
    other, done = transfers("605#4000100000000000 585#8001100000000206 585#4300100092010200")
    assert (other.entry, other.outcome, other.partial) == (
        (0x1001, 0),
        TransferOutcome.ABORTED,
        True,
    )
    assert str(other).startswith("transfer of 1001h:00 ")
    assert (done.entry, done.outcome, done.partial) == ((0x1000, 0), TransferOutcome.DONE, False)


def test_a_request_that_is_sent_again_is_one_transfer() -> None:
    (found,) = transfers(
        "605#4000100000000000 605#4000100000000000 585#4300100092010200 585#4300100092010200"
    )
    assert (found.retries, found.duration_us, found.value) == (1, 2_000, 0x0002_0192)


def test_a_request_without_answer_is_unanswered_when_the_next_one_comes() -> None:
    unanswered, done = transfers("605#4000100000000000 605#4001100000000000 585#4F01100000000000")
    assert (unanswered.outcome, unanswered.entry) == (TransferOutcome.UNANSWERED, (0x1000, 0))
    assert done.outcome is TransferOutcome.DONE


def test_a_transfer_that_runs_at_the_end_is_pending() -> None:
    decoder = Decoder()
    decoder.take(Record(1_000, "can0", CanFrame.parse("605#4000100000000000")))
    (pending,) = decoder.pending(501_000)
    assert (pending.outcome, pending.duration_us) == (TransferOutcome.UNANSWERED, 500_000)
    assert pending.name == "device_type"


def test_a_transfer_that_the_client_leaves_is_broken_off() -> None:
    broken, _ = transfers(
        "605#4008100000000000 585#410810000F000000 605#4001100000000000 585#4F01100000000000"
    )
    assert broken.outcome is TransferOutcome.BROKEN


def test_an_answer_whose_request_was_not_heard_still_has_its_value() -> None:
    (found,) = transfers("585#4300100092010200")
    assert (found.partial, found.value, found.duration_us) == (True, 0x0002_0192, 0)


def test_a_late_answer_leaves_the_next_transfer_alone() -> None:
    asked, late, done = transfers(
        "605#4000100000000000 605#4001100000000000 585#4300100092010200 585#4F01100007000000"
    )
    assert asked.outcome is TransferOutcome.UNANSWERED
    assert (late.partial, late.entry) == (True, (0x1000, 0))
    assert (done.partial, done.entry, done.value) == (False, (0x1001, 0), 7)


def test_a_frame_that_names_an_object_is_about_that_one() -> None:
    late = last("605#4000100000000000 605#4001100000000000 585#4300100092010200")
    assert late.entry == (0x1000, 0)


def test_segments_of_an_upload_without_beginning_are_a_value_of_an_unknown_object() -> None:
    (found,) = transfers("605#7000000000000000 585#1173697800000000")
    assert (found.entry, found.partial, found.data) == (None, True, b"six\0\0\0\0")
    assert str(found).startswith("upload an unknown object = 0x00000000786973 (segmented, 7 B")


def test_segments_of_a_download_without_beginning_are_a_value_of_an_unknown_object() -> None:
    (found,) = transfers("605#1973697800000000 585#3000000000000000")
    assert (found.entry, found.partial, found.data) == (None, True, b"six")


def test_a_segmented_download_whose_request_was_not_heard_keeps_its_object() -> None:
    (found,) = transfers("585#6007200000000000 605#0973697800000000 585#2000000000000000")
    assert (found.entry, found.partial, found.data) == ((0x2007, 0), True, b"six")


def test_a_segment_that_is_sent_again_counts_once() -> None:
    (found,) = transfers(
        "605#2107200003000000 585#6007200000000000"
        " 605#0973697800000000 605#0973697800000000 585#2000000000000000"
    )
    assert (found.data, found.retries, found.flaws) == (b"six", 1, ())


def test_a_segment_that_is_answered_twice_counts_once() -> None:
    (found,) = transfers(
        "605#4007200000000000 585#410720000A000000 605#6000000000000000 585#0061626364656667"
        " 585#0061626364656667 605#7000000000000000 585#1968696A00000000"
    )
    assert (found.data, found.flaws) == (b"abcdefghij", ())


def test_a_size_that_does_not_fit_is_a_flaw() -> None:
    (found,) = transfers(
        "605#4007200000000000 585#4107200009000000 605#6000000000000000 585#0B73000000000000"
    )
    assert (found.outcome, found.flaws) == (TransferOutcome.DONE, ("size 9 was said",))


def test_blocks_without_beginning_end_in_no_transfer() -> None:
    found = decode("585#C60720001E000000 605#A2017F0000000000 605#A100000000000000")
    assert all(not decoded.transfers for decoded in found)
    assert found[-1].text.endswith("beginning is missing")


def test_a_block_upload_may_be_switched_to_a_short_one() -> None:
    (found,) = transfers("605#A40010007F040000 585#4300100092010200")
    assert (found.mode, found.value) == (TransferMode.EXPEDITED, 0x0002_0192)


def test_a_wrong_crc_is_a_flaw() -> None:
    (found,) = transfers(
        "605#A40810007F000000 585#C608100004000000 605#A300000000000000 585#8145504F53000000"
        " 605#A2017F0000000000 585#CD74FB0000000000 605#A100000000000000"
    )
    assert (found.flaws, found.value) == (("wrong CRC",), "EPOS")


def test_a_receipt_that_was_not_heard_is_a_flaw() -> None:
    (found,) = transfers(
        "605#A40810007F000000 585#C608100004000000 605#A300000000000000 585#8145504F53000000"
        " 585#CD73FB0000000000 605#A100000000000000"
    )
    assert "a confirmation is missing" in found.flaws


def test_a_further_sdo_server_is_followed_once_its_cob_ids_are_known() -> None:
    found = transfers(
        "605#2301120185060000 585#6001120100000000 605#2301120295060000 585#6001120200000000"
        " 685#4000100000000000 695#4300100092010200"
    )
    assert [t.entry for t in found] == [(0x1201, 1), (0x1201, 2), (0x1000, 0)]


def test_receipts_of_segments_that_were_not_heard_are_no_data() -> None:
    found = decode("605#2107200003000000 585#6007200000000000 585#2000000000000000")
    assert found[-1].text.startswith("confirmation of a missing segment")


def test_a_short_frame_in_a_block_is_no_segment() -> None:
    begun = "605#C607200003000000 585#A40720007F000000"
    assert last(f"{begun} 605#81").text == "an SDO frame of 1 bytes, it has 8"


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        ("4308100045504F53", "'EPOS'"),
        ("4308100000000000", "''"),
        ("4F17100007000000", "0x07"),  # one byte of a heartbeat time, which has two
        ("4F00200007000000", "0x07"),
        ("4303100130810000", "0x00008130"),
    ],
)
def test_a_value_is_written_by_its_type(answer: str, text: str) -> None:
    (found,) = transfers(f"585#{answer}")
    assert found.text == text


def test_frames_of_a_wrong_length_are_said_to_be() -> None:
    assert last("605#40").text == "an SDO frame of 1 bytes, it has 8"
    assert last("585#40").text == "an SDO frame of 1 bytes, it has 8"
    assert last("605#R").text == "remote frame"


def test_an_unknown_command_is_said_to_be() -> None:
    assert last("605#E000000000000000").text == "client command E0h is not of CiA 301"
    assert last("585#E000000000000000").text == "server command E0h is not of CiA 301"


@pytest.mark.parametrize(
    ("answer", "text", "length"),
    [
        ("42191000090000AA", "9", "size not indicated"),  # what is behind means nothing
        ("4219100009000000", "9", "size not indicated"),
        ("42171000E80300AA", "1000", "size not indicated"),
        ("42001000920102AA", "0xAA020192", ""),  # four bytes are what it has
        ("4319100009000000", "9", "4 B where UNSIGNED8 has 1"),
        ("4B19100009000000", "9", "2 B where UNSIGNED8 has 1"),
        ("43191000090000AA", "0xAA000009", "4 B where UNSIGNED8 has 1"),
        ("4F17100007000000", "0x07", "1 B where UNSIGNED16 has 2"),
        ("42002000090000AA", "0xAA000009", "size not indicated"),
        ("4F19100009000000", "9", ""),
    ],
)
@pytest.mark.parametrize("write", [False, True])
def test_a_value_is_read_whatever_length_is_told(
    answer: str, text: str, length: str, write: bool
) -> None:
    if write:
        command = {"42": "22", "43": "23", "4B": "2B", "4F": "2F"}[answer[:2]]
        found = transfers(f"605#{command}{answer[2:]} 585#60{answer[2:8]}00000000")
    else:
        found = transfers(f"605#40{answer[2:8]}00000000 585#{answer}")
    (transfer,) = found
    assert (transfer.text, transfer.length) == (text, length)
    assert (length in str(transfer)) is True


def test_what_is_learnt_has_the_length_of_its_type() -> None:
    decoder = Decoder()
    for text in ("605#4017100000000000", "585#42171000E80300AA"):
        decoder.take(Record(0, "can0", CanFrame.parse(text)))
    assert decoder.memory("can0", 5).number(0x1017, 0) == 1_000


def test_segments_of_an_unknown_number_are_said_to_be_so() -> None:
    assert last("605#4008100000000000 585#4008100000000000").text == (
        "segments follow, their size is not indicated"
    )
    assert last("605#4008100000000000 585#4108100005000000").text == ("segments follow, 0 of 5 B")
