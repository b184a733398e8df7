"""What is said to a slave during its boot-up, and told of it step by step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tickrig.host.canopen.dialogue import AwaitReport, Script
from tickrig.host.canopen.errors import SdoFailed, SdoTimeout
from tickrig.host.canopen.master.assignment import ObjectWrite
from tickrig.host.canopen.master.boot_status import BootStatus
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.wire.canopen.nmt import NmtState

TRIES: Final = 4
"""A slave that may just have been reset is asked so often."""

U32: Final = 4


@dataclass(frozen=True, slots=True)
class BootStep:
    """One step of a boot-up, for people.

    Attributes:
        request: what was said to the slave, or waited for.
        answer: what came.
        meaning: what follows.
    """

    request: str
    answer: str
    meaning: str

    def __str__(self) -> str:
        """Return it in a line."""
        return f"{self.request}: {self.answer}; {self.meaning}"


OnStep = Callable[[BootStep], None]


class BootEnded(Exception):  # noqa: N818 - how a boot-up ends, in the middle of it
    """The slave cannot be booted.

    Attributes:
        status: why.
    """

    def __init__(self, status: BootStatus) -> None:
        super().__init__(status.text)
        self.status = status


class BootTalk:
    """Reads, writes and waits; each step is told.

    Args:
        on_step: called with each step.
    """

    def __init__(self, on_step: OnStep) -> None:
        self._on_step = on_step

    def report(
        self, what: str, wait_us: int, status: BootStatus, *, boot_up: bool = True
    ) -> Script[NmtState]:
        """Wait for a boot-up or a state; end the boot-up without one."""
        state: NmtState | None = yield AwaitReport(wait_us, boot_up)
        if state is None:
            self.record(what, f"none within {wait_us // 1_000} ms", status.text)
            raise BootEnded(status)
        self.record(what, state_text(state), "goes on")
        return state

    def read(
        self, index: int, sub: int, name: str, status: BootStatus, tries: int = 1
    ) -> Script[bytes]:
        """Read an object; end the boot-up if it cannot be read."""
        what = f"{index:04X}h:{sub:02X} {name}"
        data = yield from self.attempt(index, sub, what, tries)
        if isinstance(data, SdoFailed):
            self.record(what, str(data), status.text)
            raise BootEnded(status)
        return data

    def attempt(self, index: int, sub: int, what: str, tries: int) -> Script[bytes | SdoFailed]:
        """Read an object, once more after a time-out; return what was raised at last."""
        for _ in range(tries - 1):
            try:
                return (yield from upload(index, sub))
            except SdoTimeout:
                self.record(what, "no answer", "asked again")
            except SdoFailed as error:
                return error
        try:
            return (yield from upload(index, sub))
        except SdoFailed as error:
            return error

    def write(
        self,
        write: ObjectWrite,
        status: BootStatus,
        *,
        what: str = "",
        tries: int = 1,
        answered: bool = True,
    ) -> Script[None]:
        """Write an object; end the boot-up if it is refused, or not answered.

        Args:
            write: what to write.
            status: of the end.
            what: for the step; object and value unless given.
            tries: so often, as long as there is no answer.
            answered: an answer is needed.
        """
        what = what or f"{write.index:04X}h:{write.sub:02X} := {as_hex(write.data)}"
        try:
            yield from self._download(write, what, tries)
        except SdoFailed as error:
            if isinstance(error, SdoTimeout) and not answered:
                self.record(what, "no answer", "which need not be; goes on")
                return
            self.record(what, str(error), status.text)
            raise BootEnded(status) from error
        self.record(what, "taken", "goes on")

    def _download(self, write: ObjectWrite, what: str, tries: int) -> Script[None]:
        for left in range(tries - 1, 0, -1):
            try:
                return (yield from download(write.index, write.sub, write.data))
            except SdoTimeout:
                self.record(what, "no answer", f"said again, {left} more")
        return (yield from download(write.index, write.sub, write.data))

    def compare(self, what: str, data: bytes, expected: int, status: BootStatus) -> None:
        """End the boot-up if a number is another than expected; 0 expects nothing."""
        if expected and not is_value(data, expected):
            self.record(what, as_hex(data), f"not {expected:08X}h: {status.text}")
            raise BootEnded(status)
        self.record(what, as_hex(data), "as expected" if expected else "not looked at")

    def record(self, request: str, answer: str, meaning: str) -> None:
        """Tell a step."""
        self._on_step(BootStep(request, answer, meaning))


_STATES: Final = {
    NmtState.INITIALISING: "boot-up",
    NmtState.STOPPED: "Stopped",
    NmtState.OPERATIONAL: "Operational",
    NmtState.PRE_OPERATIONAL: "Pre-operational",
}


def state_text(state: NmtState) -> str:
    """Return a state as people write it."""
    return _STATES[state]


def is_value(data: bytes, expected: int) -> bool:
    """Say whether data is a number of 32 bits."""
    return len(data) == U32 and int.from_bytes(data, "little") == expected


def as_hex(data: bytes) -> str:
    """Return a value as a number; what is longer than eight bytes as their count."""
    return f"{data[::-1].hex().upper()}h" if 0 < len(data) <= 8 else f"{len(data)} bytes"
