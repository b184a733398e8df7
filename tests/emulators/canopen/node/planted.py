"""A CANopen master on python-can with mistakes that masters have, one at a time."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import ClassVar, Final

import can

from tests.emulators.canopen.node.test_node_faults import LONG_NAME, bench_of
from tickrig import Bench
from tickrig.testing import BenchMachine, host_rule

MISTAKES: Final = (
    "no_timeout",
    "abort_as_data",
    "toggle_ignored",
    "late_answer_believed",
    "emcy_ignored",
    "heartbeat_loss_unseen",
    "boot_up_as_heartbeat",
    "restart_race",
    "old_cob_id",
    "lost_sync_unseen",
    "stale_statusword",
    "not_used_again",
)

NODE: Final = 2
HEARTBEAT_S: Final = 0.1
LOST_S: Final = 0.25
TIMEOUT_S: Final = 0.5
NAME: Final = 0x1008
SPEED: Final = 0x6081


class MasterError(Exception):
    """What the master reports as wrong."""


class Master:
    """Reads, supervises and restarts one node.

    Args:
        bus: of python-can.
        clock: returns the time in seconds.
        mistake: one of `MISTAKES`, empty for none.
    """

    def __init__(self, bus: can.BusABC, clock: Callable[[], float], mistake: str = "") -> None:
        self.bus, self.clock, self.mistake = bus, clock, mistake
        self.heartbeat_s: float | None = None
        self.pdo_id, self.pdo, self.pdo_s = 0x180 + NODE, b"", 0.0
        self.errors, self.restarts, self.lost = list[int](), 0, False

    def send(self, can_id: int, data: bytes) -> None:
        self.bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def receive(self, timeout_s: float) -> tuple[int, bytes] | None:
        """Take the next frame, after looking at what it tells of the node."""
        message = self.bus.recv(timeout_s)
        if message is None:
            return None
        can_id, data = message.arbitration_id, bytes(message.data)
        if can_id == 0x80 + NODE and self.mistake != "emcy_ignored":
            self.errors.append(int.from_bytes(data[:2], "little"))
        elif can_id == 0x700 + NODE:
            if data == b"\0" and self.mistake != "boot_up_as_heartbeat":
                self.restarts += 1
            self.heartbeat_s, self.lost = self.clock(), False
        elif can_id == self.pdo_id:
            self.pdo, self.pdo_s = data, self.clock()
        return can_id, data

    def answer(self, request: bytes) -> bytes:
        """Return the answer of the SDO server."""
        if self.lost and self.mistake == "not_used_again":
            raise MasterError("the node was lost")
        self.send(0x600 + NODE, request)
        end_s = self.clock() + TIMEOUT_S
        while True:
            heard = self.receive(max(end_s - self.clock(), 0.001))
            if self.clock() >= end_s and heard is None and self.mistake != "no_timeout":
                raise MasterError("no answer")
            if heard is not None and heard[0] == 0x580 + NODE:
                if heard[1][0] == 0x80 and self.mistake != "abort_as_data":
                    raise MasterError("aborted")
                return heard[1]

    def read(self, index: int) -> bytes:
        """Read an object, in segments if it is long."""
        head = index.to_bytes(2, "little") + b"\0"
        answer = self.answer(b"\x40" + head + bytes(4))
        if answer[1:4] != head and self.mistake != "late_answer_believed":
            raise MasterError("an answer for another object")
        if answer[0] & 2 or answer[0] == 0x80:
            return answer[4 : 8 - (answer[0] >> 2 & 3)]
        size, data, toggle = int.from_bytes(answer[4:], "little"), b"", 0
        while len(data) < size:
            segment = self.answer(bytes([0x60 | toggle]) + bytes(7))
            wrong = segment[0] & 0xE0 or segment[0] & 0x10 != toggle
            if wrong and self.mistake != "toggle_ignored":
                self.send(0x600 + NODE, bytes.fromhex("8000000000000305"))
                raise MasterError("wrong toggle bit")
            data, toggle = data + segment[1 : 8 - (segment[0] >> 1 & 7)], toggle ^ 0x10
            if segment[0] & 1:
                break
        return data[:size]

    def write(self, index: int, sub: int, value: int, size: int) -> None:
        head = bytes([0x2F - 4 * (size - 1)]) + index.to_bytes(2, "little") + bytes([sub])
        answer = self.answer(head + value.to_bytes(4, "little"))
        if answer[1:4] != head[1:]:
            raise MasterError("an answer for another object")

    def configure(self) -> None:
        """Let the node send heartbeats, and a synchronous PDO with statusword and position."""
        self.write(0x1017, 0, round(HEARTBEAT_S * 1_000), 2)
        self.write(0x1800, 1, 0x8000_0000 | self.pdo_id, 4)
        self.write(0x1800, 2, 1, 1)
        self.write(0x1800, 1, self.pdo_id, 4)
        self.send(0, bytes([1, NODE]))
        self.supervise(0.15)

    def supervise(self, duration_s: float) -> None:
        """Look at what comes for a time."""
        end_s = self.clock() + duration_s
        while (left_s := end_s - self.clock()) > 0:
            self.receive(max(left_s, 0.001))
            silent_s = self.clock() - (self.heartbeat_s or 0.0)
            if silent_s > LOST_S and self.mistake != "heartbeat_loss_unseen":
                self.lost = True

    def restart(self) -> None:
        """Reset the node, and configure it again."""
        self.send(0, bytes([129, NODE]))
        before, waited = self.restarts, 0
        if self.mistake == "restart_race":  # it waits for a time, and looks at no answer
            self.supervise(0.1)
            with suppress(MasterError):
                self.configure()
            return
        while self.restarts == before:
            self.supervise(0.05)
            waited += 1
            if waited > 100:
                raise MasterError("no boot-up")
        self.configure()

    def remap(self) -> None:
        """Give the PDO another CAN-ID."""
        can_id = 0x1A0 + NODE
        self.write(0x1800, 1, 0x8000_0000 | self.pdo_id, 4)
        self.write(0x1800, 1, can_id, 4)
        if self.mistake != "old_cob_id":
            self.pdo_id = can_id

    def sync(self) -> None:
        self.send(0x80, b"")
        self.supervise(0.02)

    def position(self) -> int:
        """Return the position at a SYNC."""
        sent_s = self.clock()
        self.sync()
        if self.pdo_s < sent_s and self.mistake != "lost_sync_unseen":
            raise MasterError("no PDO after SYNC")
        return int.from_bytes(self.pdo[2:6], "little", signed=True)

    def statusword(self) -> int:
        """Return the statusword of the latest PDO, which must be fresh."""
        self.sync()
        if self.clock() - self.pdo_s > 0.05 and self.mistake != "stale_statusword":
            raise MasterError("the statusword is old")
        return int.from_bytes(self.pdo[:2], "little")


class Supervision(BenchMachine):
    """The master on a bench; what it says of the node must be so, or it must report an error."""

    mistake: ClassVar[str] = ""
    inputs = ()
    patience = "8s"
    folder: ClassVar[Path]

    def make_bench(self) -> Bench:
        return bench_of(self.folder)

    def warm_up(self) -> None:
        self.bench.run_for("50ms")

    def connect(self) -> None:
        self.bus, self.witness = self.bench.can_bus(), self.bench.can_bus()
        self.master = Master(self.bus, lambda: self.bench.now_us / 1e6, self.mistake)
        self.master.configure()
        self.heard: list[tuple[int, bytes]] = []
        self.look()

    def disconnect(self) -> None:
        self.bus.shutdown()
        self.witness.shutdown()

    def look(self) -> None:
        """Take what was on the bus meanwhile."""
        while (message := self.witness.recv(0)) is not None:
            self.heard.append((message.arbitration_id, bytes(message.data)))

    @host_rule(index=(NAME, SPEED))
    def read(self, index: int) -> None:
        with suppress(MasterError):
            expected = LONG_NAME.encode() if index == NAME else (1000).to_bytes(4, "little")
            assert self.master.read(index) == expected, "it believes wrong data"

    @host_rule()
    def supervise(self) -> None:
        while self.master.receive(0) is not None:
            pass  # it came before
        self.look()
        self.heard.clear()
        errors, restarts = len(self.master.errors), self.master.restarts
        self.master.supervise(0.5)
        self.look()
        emcys = [data for can_id, data in self.heard if can_id == 0x80 + NODE]
        beats = [data for can_id, data in self.heard if can_id == 0x700 + NODE]
        assert len(self.master.errors) - errors == len(emcys), "it ignores an EMCY"
        assert self.master.restarts - restarts == beats.count(b"\0"), "it ignores a restart"
        assert self.master.lost or beats, "it does not notice that heartbeats are missing"

    @host_rule()
    def restart(self) -> None:
        with suppress(MasterError):
            self.master.restart()
            assert self.bench.get("axis2/0x1017") == 100, "the node is not configured"

    @host_rule()
    def remap(self) -> None:
        with suppress(MasterError):
            self.master.remap()

    @host_rule(at=(100, 200))
    def position(self, at: int) -> None:
        self.bench.set("axis2/0x6064", at)
        with suppress(MasterError):
            position = self.master.position()
            assert position == self.bench.get("axis2/0x6064"), "the position is an old one"

    @host_rule(to=(6, 7))
    def command(self, to: int) -> None:
        with suppress(MasterError):
            self.master.write(0x6040, 0, to, 2)
            word = self.master.statusword()
            assert word == self.bench.get("axis2/0x6041"), "the statusword is an old one"

    def end(self) -> None:
        self.calm()
        self.master.supervise(1)
        try:
            assert self.master.read(SPEED) == (1000).to_bytes(4, "little")
        except MasterError as error:
            raise AssertionError(f"the node is well, and not used: {error}") from None
