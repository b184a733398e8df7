from __future__ import annotations

import pytest

from tests.host.canmon.tui.rig_session import BUS, NODE, RigSession
from tickrig.host.canmon.model.node_dictionary import ObjectRow, Origin
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryTask
from tickrig.wire.can import CanFrame

NAME, HEARTBEAT, STATUSWORD = (0x1008, 0), (0x1017, 0), (0x6041, 0)


class Client:
    """The task on a session with our drive."""

    def __init__(self, *, armed: bool = True, eds: bool = True) -> None:
        self.session = RigSession(eds=eds)
        self.task = DictionaryTask(self.session.model.decoder)
        self.session.tasks.append(self.task)
        self.session.run(10_000)
        self.task.choose((BUS, NODE))
        if armed:
            self.session.arm()

    def read(self, *entries: tuple[int, int]) -> None:
        for entry in entries:
            self.task.read(self.session.now_us, entry)
        self.session.run(1_000_000)

    def write(self, entry: tuple[int, int], data: bytes) -> None:
        self.task.write(self.session.now_us, entry, data)
        self.session.run(1_000_000)

    def row(self, entry: tuple[int, int]) -> ObjectRow:
        rows = self.task.objects((BUS, NODE)).rows()
        return next(row for row in rows if row.entry == entry)


def test_an_object_is_read_from_our_drive() -> None:
    client = Client()
    client.read(NAME)
    row = client.row(NAME)
    assert (row.value, row.origin, row.trouble) == ("'EPOS'", Origin.SDO, "")
    assert (client.task.result, client.task.left) == ("read 1008h:00: done", 0)


def test_an_object_is_written_and_the_drive_does_it() -> None:
    client = Client()
    client.write(HEARTBEAT, b"\x64\x00")
    assert client.row(HEARTBEAT).value == "100"
    before = client.session.model.frames
    client.session.run(1_000_000)
    assert client.session.model.frames - before == 10


def test_many_objects_are_read_one_after_the_other() -> None:
    client = Client()
    client.read(NAME, HEARTBEAT, STATUSWORD)
    found = [client.row(entry).origin for entry in (NAME, HEARTBEAT, STATUSWORD)]
    assert found == [Origin.SDO] * 3


def test_a_refusal_stands_beside_the_object_until_it_is_read() -> None:
    client = Client()
    client.write(STATUSWORD, b"\x00\x00")
    assert client.row(STATUSWORD).trouble == "object is read only (06010002h)"
    assert client.task.result == "6041h:00 aborted: 06010002h READ_ONLY"
    client.read(STATUSWORD)
    assert client.row(STATUSWORD).trouble == ""


def test_a_node_that_is_silent_is_told_after_the_time_out() -> None:
    client = Client()
    client.task.choose((BUS, 9))
    client.read(NAME)
    assert client.task.result == "1008h:00 was not answered"
    assert client.session.frames == ["609#4008100000000000", "609#8008100000000405"]


def test_nothing_is_sent_while_it_is_not_armed() -> None:
    client = Client(armed=False)
    client.read(NAME)
    assert client.session.frames == []


@pytest.mark.parametrize("ending", ["disarm", "choose"])
def test_transfers_are_given_up(ending: str) -> None:
    client = Client()
    client.task.read(client.session.now_us, NAME)
    if ending == "disarm":
        client.session.disarm()
    else:
        client.task.choose((BUS, 9))
    client.session.run(1_000_000)
    assert (client.session.frames, client.task.left) == ([], 0)


def test_a_watched_object_is_read_each_second_until_it_is_watched_no_more() -> None:
    client = Client()
    client.task.watch(client.session.now_us, STATUSWORD)
    client.session.run(2_500_000)
    assert client.session.frames == ["605#4041600000000000"] * 3
    client.task.watch(client.session.now_us, STATUSWORD)
    client.session.run(2_500_000)
    assert len(client.session.frames) == 3


def test_a_watched_object_that_is_not_answered_is_asked_for_again_after_its_time_out() -> None:
    client = Client()
    client.task.choose((BUS, 9))
    client.task.watch(client.session.now_us, NAME)
    client.session.run(2_400_000)
    client.session.disarm()
    client.session.run(2_000_000)
    first, again = "08100000000000", "00100000000000"  # 1008h may still be answered: first 1000h
    assert client.session.frames == [
        *(f"609#40{first}", "609#8008100000000405", f"609#40{again}", "609#8000100000000405"),
        f"609#40{again}",
    ]


def test_values_of_pdos_are_heard() -> None:
    client = Client()
    client.session.arm()
    client.write((0x1017, 0), b"\0\0")
    client.session.buses[BUS](CanFrame.parse("000#0105"))
    client.session.run(500_000)
    row = client.row(STATUSWORD)
    assert (row.origin, row.text.name) == (Origin.PDO, "statusword")


def test_without_an_eds_the_objects_are_those_that_were_heard() -> None:
    client = Client(eds=False)
    client.read(NAME)
    assert [row.entry for row in client.task.objects((BUS, NODE)).rows()] == [NAME]
