"""The download of software at boot-up, as a script (CiA 302-3, program download)."""

from __future__ import annotations

from typing import Final

from tickrig.host.canopen.dialogue import Pause, Script
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.canopen.master.assignment import ObjectWrite
from tickrig.host.canopen.master.boot_status import BootStatus
from tickrig.host.canopen.master.boot_talk import TRIES, U32, BootEnded, BootTalk

DATA: Final = 0x1F50
CONTROL: Final = 0x1F51
IDENTIFICATION: Final = 0x1F56
FLASH_STATUS: Final = 0x1F57

STOP: Final = 0
START: Final = 1
CLEAR: Final = 3
"""Program control, 1F51h:01."""

LOOK_US: Final = 100_000
LOOKS: Final = 600
"""Flash status and program control are looked at so often, for a minute."""

BUSY: Final = 0x01
"""Bit of the flash status; bits 1 to 7 are an error code."""

FAILED: Final = BootStatus.UPDATE_FAILED


def update_program(talk: BootTalk, program: bytes, expected: int) -> Script[None]:
    """Stop and clear the program, download another, see that it is the right one, start it.

    Args:
        talk: with the slave.
        program: what is downloaded, segmented.
        expected: its identification.

    Raises:
        BootEnded: it failed.
    """
    yield from _stop(talk)
    yield from talk.write(_control(CLEAR), FAILED, what="1F51h:01 := clear", tries=TRIES)
    what = f"1F50h:01 := {len(program)} bytes"
    yield from talk.write(ObjectWrite(DATA, 1, program), FAILED, what=what, tries=TRIES)
    yield from _await_flash(talk)
    data = yield from talk.read(IDENTIFICATION, 1, "software identification", FAILED)
    talk.compare("1F56h:01 software identification", data, expected, FAILED)
    yield from talk.write(_control(START), FAILED, what="1F51h:01 := start", answered=False)
    yield from _await_start(talk)


def _control(command: int) -> ObjectWrite:
    return ObjectWrite(CONTROL, 1, bytes((command,)))


def _stop(talk: BootTalk) -> Script[None]:
    """Stop the program, unless it says that it is."""
    what = "1F51h:01 program control"
    data = yield from talk.attempt(CONTROL, 1, what, 1)
    if data == bytes((STOP,)):
        talk.record(what, "stopped", "goes on")
        return
    yield from talk.write(_control(STOP), FAILED, what="1F51h:01 := stop", answered=False)


def _await_flash(talk: BootTalk) -> Script[None]:
    """Wait until the flash is written."""
    what = "1F57h:01 flash status"
    for _ in range(LOOKS):
        yield Pause(LOOK_US)
        data = yield from talk.attempt(FLASH_STATUS, 1, what, 1)
        if isinstance(data, SdoFailed) or len(data) != U32 or data[0] & BUSY:
            continue
        if error := data[0] >> 1:
            talk.record(what, f"error {error}", FAILED.text)
            raise BootEnded(FAILED)
        talk.record(what, "written", "goes on")
        return
    talk.record(what, f"not written after {LOOKS} looks", FAILED.text)
    raise BootEnded(FAILED)


def _await_start(talk: BootTalk) -> Script[None]:
    """Wait until the program runs."""
    for _ in range(LOOKS):
        yield Pause(LOOK_US)
        data = yield from talk.read(CONTROL, 1, "program control", FAILED, TRIES)
        if data == bytes((START,)):
            talk.record("1F51h:01 program control", "started", "booted from the beginning")
            return
    talk.record("1F51h:01 program control", f"not started after {LOOKS} looks", FAILED.text)
    raise BootEnded(FAILED)
