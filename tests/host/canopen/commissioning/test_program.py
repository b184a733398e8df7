"""Programs by block transfer: into our boot loader, and into durand; over a bad line."""

from __future__ import annotations

from binascii import crc32
from typing import Any

import canopen
import pytest
from durand import DatatypeEnum, Node, Variable
from durand.network import NetworkABC

from tests.host.canopen.commissioning.net_bench import NetBench
from tickrig.device.canopen.models.f_palette_boot import make_f_palette_boot
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.testing.conformance.durand_slave import DurandSlave
from tickrig.host.canopen.commissioning.program import (
    Program,
    ProgramFailed,
    ProgramStatus,
    download_blocks,
)
from tickrig.host.canopen.errors import SdoAborted, SdoTimeout
from tickrig.wire.canopen.sdo import parse_response
from tickrig.wire.canopen.sdo_frame import BlockAcknowledge, BlockDownloadInitiateResponse

MEGABYTE = 1_048_576
NODE = 5


def firmware(size: int) -> bytes:
    return bytes((index * index >> 3 ^ index * 7) & 0xFF for index in range(size))


class Target:
    """A node that takes a program, and what it has of it."""

    def __init__(self, durand: bool = False, seed: int = 0) -> None:
        self.taken: list[bytes] = []
        self.ours = make_f_palette_boot(NODE)
        self.bench = NetBench(DurandSlave(self._make) if durand else self.ours, seed=seed)
        self.said: list[str] = []
        self.program = Program(self.bench.bus, NODE, 1, self.said.append)

    def _make(self, network: NetworkABC) -> Node:
        node = Node(network, NODE)
        data: Any = Variable(DatatypeEnum.DOMAIN, "rw", name="program")
        node.object_dictionary[0x1F50] = data
        node.object_dictionary.download_callbacks[0x1F50, 0].add(self.taken.append)
        return node

    def flashed(self) -> bytes:
        """Return what the node has taken."""
        return self.taken[-1] if self.taken else self.ours.nonvolatile.program or b""

    def transferred(self) -> list[str]:
        """Return the frames of block transfer."""
        sdo = [text for text in self.bench.frames if text[:3] in ("605", "585")]
        first = next(place for place, text in enumerate(sdo) if text.startswith("605#C6"))
        return sdo[first:]


def stopped(seed: int = 0) -> Target:
    """Make one of ours that waits for a program."""
    target = Target(seed=seed)
    target.program.stop()
    target.program.clear()
    return target


@pytest.mark.parametrize("corrupt", [0, 0.01], ids=["good line", "1 % corrupted"])
@pytest.mark.parametrize("durand", [False, True], ids=["ours", "durand"])
def test_a_megabyte_arrives_equal_to_the_byte(durand: bool, corrupt: float) -> None:
    target = Target(durand=True) if durand else stopped()
    if corrupt:
        target.bench.wire.faults.arm("corrupt", str(corrupt))
    target.bench.wire.observers.clear()
    data, progress = firmware(MEGABYTE), list[int]()
    assert target.program.download(data, progress.append) == 1
    assert target.flashed() == data
    assert progress == sorted(progress)
    assert progress[-1] == MEGABYTE


def test_what_is_lost_within_a_block_is_sent_again() -> None:
    target = stopped()
    target.bench.wire.faults.arm("drop", "0.002")
    data = firmware(6_000)
    assert target.program.download(data, lambda done: None) == 1
    acknowledged = [text for text in target.bench.frames if text.startswith("585#A2")]
    assert any(text[6:8] != "7F" for text in acknowledged[:-1]), "a block was not whole"
    assert target.flashed() == data


@pytest.mark.parametrize(("durand", "rate"), [(False, 0.01), (True, 0.005)], ids=["ours", "durand"])
def test_a_transfer_that_broke_off_begins_anew(durand: bool, rate: float) -> None:
    target = Target(durand=True) if durand else stopped()
    target.bench.wire.faults.arm("drop", str(rate))
    data = firmware(5_000)
    tries = target.program.download(data, lambda done: None, tries=40)
    assert tries > 1
    assert target.flashed() == data
    assert target.said[-1].startswith("the transfer failed (")


def test_the_last_try_says_why_it_failed() -> None:
    target = stopped()
    target.bench.wire.faults.arm("drop", "0.2")
    with pytest.raises((SdoAborted, SdoTimeout)):
        target.program.download(firmware(5_000), lambda done: None, tries=2)
    assert target.flashed() == b""


def test_a_program_runs_when_all_is_done() -> None:
    target = Target()
    before = target.program.status()
    assert str(before).startswith("running; identification ")
    target.program.stop()
    target.program.clear()
    assert str(target.program.status()) == (
        "stopped; identification 00000000h; flash: no valid program"
    )
    target.program.download(firmware(100), lambda done: None)
    target.program.start()
    assert target.program.status() == ProgramStatus(1, crc32(firmware(100)), 0)
    assert target.said == ["stopped: the boot loader runs", "cleared", "started"]


def test_who_is_stopped_already_is_not_stopped_again() -> None:
    target = stopped()
    target.program.stop()
    assert target.said[-1] == "it is already stopped"


def test_what_does_not_fit_its_state_is_refused() -> None:
    target = Target()
    with pytest.raises(SdoAborted) as refused:
        target.program.download(firmware(100), lambda done: None)
    assert refused.value.code == 0x0800_0022
    with pytest.raises(SdoAborted):
        target.program.clear()


def test_a_flash_that_failed_is_told() -> None:
    target = stopped()
    target.ours.dictionary[0x1F57, 1].source = lambda entry: b"\x0a\0\0\0"
    with pytest.raises(ProgramFailed, match="1F57h:01 flash status: flash write error"):
        target.program.download(firmware(100), lambda done: None)


def test_a_flash_that_stays_busy_is_told() -> None:
    target = stopped()
    target.ours.dictionary[0x1F57, 1].source = lambda entry: b"\x01\0\0\0"
    with pytest.raises(ProgramFailed, match="the flash is busy after 60 s"):
        target.program.download(firmware(100), lambda done: None)


def test_a_program_that_does_not_start_is_told() -> None:
    target = stopped()
    with pytest.raises(ProgramFailed, match="is not running after 60 s: 1F51h:01 is stopped"):
        target.program.await_control(1)


ANSWERS = {
    "no block transfer": ("80501F0101000405", "aborted: 05040001h"),
    "a block of 0 segments": ("A4501F0100000000", "aborted: 05040002h"),
    "something else": ("60501F0100000000", "aborted: 05040001h"),
}


@pytest.mark.parametrize(("answer", "why"), ANSWERS.values(), ids=ANSWERS.keys())
def test_a_server_that_answers_wrong_ends_it(answer: str, why: str) -> None:
    script = download_blocks(0x1F50, 1, firmware(20), lambda done: None)
    next(script)
    with pytest.raises(SdoAborted, match=why):  # noqa: PT012 - what is said beside that
        script.send(parse_response(bytes.fromhex(answer)))
        script.send(None)


def test_a_server_that_takes_nothing_ends_it() -> None:
    script = download_blocks(0x1F50, 1, firmware(7), lambda done: None)
    next(script)
    script.send(BlockDownloadInitiateResponse(0x1F50, 1, crc=True, block_size=127))
    with pytest.raises(SdoAborted, match="aborted: 05040003h"):  # noqa: PT012 - again and again
        for _ in range(30):
            script.send(BlockAcknowledge(0, 127))


def test_a_node_without_block_transfer_gets_segments() -> None:
    target = stopped()
    told = list[int]()
    server = target.ours
    entry = server.dictionary[0x1F50, 1]
    assert entry.data == b""
    target.program._bus.run = refusing_blocks(target)  # type: ignore[method-assign]
    target.program.download(firmware(300), told.append)
    assert target.flashed() == firmware(300)
    assert (told, target.said[-1]) == (
        [300],
        "the node does not support block transfer; using segments",
    )


def refusing_blocks(target: Target) -> Any:
    """Let block transfers be refused as a server does that knows none; the rest is as it is."""
    run = target.bench.bus.run

    def refuse(node_id: int, script: Any, timeout_us: int = 0) -> Any:
        if script.__name__ == "download_blocks":
            raise SdoAborted(0x1F50, 1, 0x0504_0001)
        return run(node_id, script, timeout_us)

    return refuse


def test_the_client_of_the_canopen_library_says_the_same() -> None:
    ours, other = stopped(), stopped()
    ours.program._transfer(firmware(2_000), lambda done: None)
    network = SimNetwork(other.bench.rig, other.bench.wire.end())
    objects = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]  # of the library
    node = canopen.RemoteNode(NODE, objects)
    network.add_node(node)
    with node.sdo.open(
        0x1F50, 1, "wb", size=2_000, block_transfer=True, request_crc_support=True
    ) as stream:
        stream.write(firmware(2_000))
    assert ours.flashed() == other.flashed() == firmware(2_000)
    assert ours.transferred() == other.transferred()
