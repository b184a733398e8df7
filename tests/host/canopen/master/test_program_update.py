"""Software that is downloaded at boot-up (CiA 302-2 and 302-3)."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.host.canopen.master.boot_loader import FLASHING_US, RUNS, BootLoader
from tests.host.canopen.master.network import NODE_ID, network, plain_slave
from tickrig.host.canopen.errors import SdoTimeout
from tickrig.host.canopen.master.assignment import ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.boot_slave import BootEnded, BootStatus, BootStep, BootTalk
from tickrig.host.canopen.master.canopen_master import BootFailed
from tickrig.wire.canopen.nmt import NmtState

NEW = 0x0001_0003
PROGRAM = NEW.to_bytes(4, "little") + bytes(range(100))
LEFT = SlaveAssignment(NODE_ID, "left", software_version=NEW, program=PROGRAM)


def test_other_software_is_replaced_and_the_slave_booted_from_the_beginning() -> None:
    slave = plain_slave(application=BootLoader)
    loader = BootLoader.of(slave)
    with network(LEFT, slaves=(slave,)) as net:
        net.master.boot()
        assert (loader.program, loader.state) == (PROGRAM, RUNS)
        assert net.status() == ""
        assert net.master.slave("left").state is NmtState.OPERATIONAL
        told = net.master.explain("left")
    said = [line.split("ms  ")[-1] for line in told.splitlines()]
    assert said == [
        "1000h:00 device type: 00020192h; not checked",
        "1F56h:01 software identification: 00010002h; not 00010003h: to be updated",
        "1F51h:01 := stop: taken; goes on",
        "1F51h:01 := clear: taken; goes on",
        "1F50h:01 := 104 bytes: taken; goes on",
        "1F57h:01 flash status: written; goes on",
        "1F56h:01 software identification: 00010003h; as expected",
        "1F51h:01 := start: taken; goes on",
        "1F51h:01 program control: started; booted from the beginning",
        "1000h:00 device type: 00020192h; not checked",
        "1F56h:01 software identification: 00010003h; as expected",
        "node 5 left: booted",
    ]
    assert net.master.now_us > FLASHING_US


def test_the_right_software_is_left_alone() -> None:
    slave = plain_slave(application=BootLoader)
    loader = BootLoader.of(slave)
    loader.program = PROGRAM
    with network(replace(LEFT, program=b"another"), slaves=(slave,)) as net:
        net.master.boot()
        assert loader.program == PROGRAM


def test_h_a_slave_that_is_not_to_be_reset_is_not_updated() -> None:
    slave = plain_slave(application=BootLoader)
    with network(replace(LEFT, reset_communication=False), slaves=(slave,)) as net:
        with pytest.raises(BootFailed):
            net.master.boot("3s")
        assert net.status() == "H"


@pytest.mark.parametrize(
    ("error", "program", "reason"),
    [
        (5, PROGRAM, "1F57h:01 flash status: error 5"),
        (0, bytes(20), "1F56h:01 software identification: 00000000h"),
        (0, b"", "1F56h:01 software identification: 00010002h"),
    ],
)
def test_i_an_update_that_fails_says_why(error: int, program: bytes, reason: str) -> None:
    slave = plain_slave(application=BootLoader)
    BootLoader.of(slave).error = error
    with network(replace(LEFT, program=program), slaves=(slave,)) as net:
        with pytest.raises(BootFailed) as failure:
            net.master.boot("3s")
        assert net.status() == ("I" if program else "H")
        assert str(failure.value).endswith(reason)


def test_i_a_slave_without_a_boot_loader() -> None:
    slave = plain_slave()
    slave.dictionary[0x1F51, 1].data = b"\0"
    with network(LEFT, slaves=(slave,)) as net:
        with pytest.raises(BootFailed, match="1F56h:01 software identification: 00010002h"):
            net.master.boot("3s")
        assert net.status() == "I"
        assert "1F51h:01 program control: stopped; goes on" in net.master.explain("left")


def test_flashing_that_never_ends_is_given_up_after_a_minute() -> None:
    slave = plain_slave(application=BootLoader)
    slave.dictionary[0x1F57, 1].source = lambda entry: b"\x01\0\0\0"
    with network(LEFT, slaves=(slave,)) as net:
        with pytest.raises(BootFailed, match="1F57h:01 flash status: not written after 600 polls"):
            net.master.boot("70s")
        assert net.status() == "I"


STOP = ObjectWrite(0x1F51, 1, b"\0")
LATE = SdoTimeout(0x1F51, 1)


def test_a_program_that_stops_without_an_answer_is_no_failure() -> None:
    steps: list[BootStep] = []
    script = BootTalk(steps.append).write(STOP, BootStatus.UPDATE_FAILED, answered=False)
    next(script)
    with pytest.raises(StopIteration):
        script.throw(LATE)
    assert [step.answer for step in steps] == ["no answer"]


def test_a_write_is_said_again_as_often_as_it_may_be() -> None:
    steps: list[BootStep] = []
    script = BootTalk(steps.append).write(STOP, BootStatus.UPDATE_FAILED, tries=3)
    first = next(script)
    assert [script.throw(LATE), script.throw(LATE)] == [first, first]
    with pytest.raises(BootEnded) as end:
        script.throw(LATE)
    assert end.value.status is BootStatus.UPDATE_FAILED
    said = ["no answer", "no answer", "1F51h:01 was not answered"]
    assert [step.answer for step in steps] == said
