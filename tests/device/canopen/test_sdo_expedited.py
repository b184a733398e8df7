from __future__ import annotations

import pytest

from tests.device.canopen.objects import make_bus
from tests.device.canopen.sdo_client import Client, booted
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.sdo import DownloadInitiateRequest

UPLOADS = [
    ("605#4000100000000000", "585#4300100091010F00"),  # UE-01
    ("605#5F00100000000000", "585#4300100091010F00"),  # reserved bits
    ("605#4001100000000000", "585#4F01100000000000"),  # UE-02
    ("605#4009100000000000", "585#4B09100052310000"),  # UE-04
    ("605#4018100000000000", "585#4F18100004000000"),  # UE-05
    ("605#4000100100000000", "585#8000100111000906"),  # UE-07
    ("605#4018100500000000", "585#8018100511000906"),  # UE-08
    ("605#40FF3F0000000000", "585#80FF3F0000000206"),
    ("605#4004200000000000", "585#8004200001000106"),  # UE-09
    ("605#4003100100000000", "585#8003100124000008"),  # UE-10
    ("605#4000120100000000", "585#4300120105060000"),  # UE-11
    ("605#4000120200000000", "585#4300120285050000"),
    ("605#4003200000000000", "585#4103200008000000"),  # 8 bytes need segments
    ("605#4008200000000000", "585#4108200000000000"),  # 0 bytes too
]


@pytest.mark.parametrize(("request_", "answer"), UPLOADS)
def test_an_upload_is_answered_at_once(request_: str, answer: str) -> None:
    assert booted().step(request_) == [answer]


@pytest.mark.parametrize(
    "request_",
    ["605#40001000", "605#", "605#R8", "00000605#4000100000000000", "606#4000100000000000"],
)
def test_what_is_no_request_to_this_node_is_ignored(request_: str) -> None:
    bus = booted()
    assert bus.step(request_) + bus.run(50) == []


def test_an_object_that_is_made_on_demand_is_asked_each_time() -> None:
    bus, made = booted(), [b"\4\0\0\0", b"\5\0\0\0"]
    bus.slave.dictionary[0x1000, 0].source = lambda entry: made.pop()
    answers = [text for _ in range(2) for text in bus.step("605#4000100000000000")]
    assert answers == ["585#4300100005000000", "585#4300100004000000"]


def test_an_answer_follows_the_value_and_the_node_id() -> None:
    bus, read = booted(), "4002200000000000"
    entry = bus.slave.dictionary[0x2002, 0]
    for value in (1, 1, 2):
        entry.value = value
        assert bus.step(f"605#{read}") == [f"585#430220000{value}000000"]
    bus.slave.pending_id = 6
    bus.slave.reset_node()
    bus.step()
    assert bus.step(f"606#{read}") == ["586#4302200000000000"]


DOWNLOADS = [
    ("2F002000A5000000", "6000200000000000", "4F002000A5000000"),  # DE-01
    ("2B01200034120000", "6001200000000000", "4B01200034120000"),  # DE-02
    ("23022000EFBEADDE", "6002200000000000", "43022000EFBEADDE"),  # DE-03
    ("2200200007060504", "6000200000000000", "4F00200007000000"),  # DE-04
    ("2201200007060504", "6001200000000000", "4B01200007060000"),
    ("2202200007060504", "6002200000000000", "4302200007060504"),
    ("2203200007060504", "8003200013000706", "4103200008000000"),  # 4 of 8 bytes
    ("2207200041424344", "6007200000000000", "4307200041424344"),  # a string takes all 4
    ("2F07200041000000", "6007200000000000", "4F07200041000000"),
    ("2300200001000000", "8000200012000706", "4F00200000000000"),  # DE-05
    ("2F01200001000000", "8001200013000706", "4B01200000000000"),  # DE-06
    ("2300100091010F00", "8000100002000106", "4300100091010F00"),  # DE-07
    ("2F08100041000000", "8008100002000106", "410810000F000000"),  # DE-08
    ("2F00200100000000", "8000200111000906", "8000200111000906"),  # DE-10
    ("2F06200021000000", "8006200031000906", "4F06200010000000"),  # DE-11
    ("2F0620000F000000", "8006200032000906", "4F06200010000000"),  # DE-12
    ("2F06200020000000", "6006200000000000", "4F06200020000000"),  # DE-13
    ("2300120105060000", "8000120102000106", "4300120105060000"),  # DE-16
]


@pytest.mark.parametrize(("request_", "answer", "after"), DOWNLOADS)
def test_a_download_writes_or_changes_nothing(request_: str, answer: str, after: str) -> None:
    bus = booted()
    assert bus.step(f"605#{request_}") == [f"585#{answer}"]
    multiplexer = request_[2:8]
    assert bus.step(f"605#40{multiplexer}00000000") == [f"585#{after}"]


def test_what_is_made_on_demand_is_read_over_the_bus() -> None:
    bus = booted()
    bus.slave.dictionary[0x2000, 0].source = lambda entry: b"\x2a"
    assert bus.step("605#4000200000000000") == ["585#4F0020002A000000"]


@pytest.mark.parametrize("kind", [kind for kind in DataType if kind.size])
def test_every_data_type_goes_there_and_back(kind: DataType) -> None:
    bus = make_bus([EntryDescription(0x2000, 0, "mine", kind, Access.READ | Access.WRITE)])
    bus.step()
    client, data = Client(bus), bytes(range(1, kind.size + 1))
    if kind.size <= 4:
        client.ask(DownloadInitiateRequest(0x2000, 0, data, kind.size))
    else:
        client.download(0x2000, data)
    assert bus.slave.dictionary[0x2000, 0].data == data
    assert client.upload(0x2000) == data


def test_a_boolean_is_0_or_1() -> None:
    bus = make_bus(
        [EntryDescription(0x2100, 0, "on", DataType.BOOLEAN, Access.READ | Access.WRITE)]
    )
    bus.step()
    for value, answer in (("01", "60"), ("02", "80"), ("FF", "80"), ("00", "60")):
        (sent,) = bus.step(f"605#2F002100{value}000000")
        assert sent.startswith(f"585#{answer}002100")
        assert sent.endswith("30000906" if answer == "80" else "00000000")
    assert bus.slave.dictionary[0x2100, 0].value == 0
