"""Several doors of a bus of real nodes: each sees each frame, the journal has it once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import can
import pytest
from can.interfaces.virtual import VirtualBus

from tests.emulators.testing.bench.modes.hardware.plans import Answers
from tickrig import Bench, NotOnThisBench
from tickrig.emulators.canopen.faults import NODE_FAULTS
from tickrig.emulators.record.frames import by_gap
from tickrig.emulators.testing.bench.modes.door_journal import DoorJournal, PortRecord
from tickrig.emulators.testing.rig_file.plan import (
    BusPlan,
    DeviceKind,
    DevicePlan,
    HardwarePlan,
    RigPlan,
    WirePlan,
    WireType,
)
from tickrig.host.text.trace import Mark
from tickrig.wire.can import CanFrame

BUS = BusPlan(interface="virtual", channel="doors")
DRIVE = DevicePlan(name="drive", kind=DeviceKind.MODEL, type="epos", wire="can", node_id=5)
PLAN = RigPlan(
    wires={"can": WirePlan(name="can", type=WireType.CAN, given=False)},
    devices={"drive": DRIVE},
    hardware=HardwarePlan(buses={"can": BUS}),
)
BOOT_UP = can.Message(arbitration_id=0x705, data=b"\x00", is_extended_id=False)
STUFF_ERROR = can.Message(arbitration_id=0x88, data=b"\0\0\4", is_error_frame=True)
START = can.Message(arbitration_id=0, data=b"\x01\x05", is_extended_id=False)


@pytest.fixture
def drive() -> Iterator[can.BusABC]:
    with can.Bus("doors", "virtual") as bus:
        yield bus


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench.of_plan(PLAN, "hardware") as bench:
        yield bench


@pytest.mark.parametrize("fault", [*NODE_FAULTS, "drive/drop", "drop=0.5@2s-3s"])
def test_a_fault_of_frames_is_refused_on_real_nodes(bench: Bench, fault: str) -> None:
    name = fault.partition("=")[0]
    orders: list[Callable[[], object]] = [
        lambda: bench.fault(fault),
        lambda: bench["drive"].clear(name),
    ]
    for ordered in orders:
        with pytest.raises(NotOnThisBench, match=r"no hand can make .*: it changes what passes"):
            ordered()
    assert told(bench) == []


def test_a_mistake_in_a_fault_of_real_nodes_is_told_first(bench: Bench) -> None:
    for fault, said in (
        ("sdo_slwo", "did you mean 'sdo_slow'"),
        ("sdo_slow=5", "'5' has no unit: write 5s, 5ms or 5us"),
        ("sdo_abort=zz", "'zz' is not INDEX"),
    ):
        with pytest.raises(ValueError, match=said):
            bench["drive"].fault(fault)


def test_a_physical_fault_of_a_real_node_is_asked_of_a_human() -> None:
    human = Answers("")
    with Bench.of_plan(PLAN, "hardware", human) as bench:
        bench["drive"].fault("power_off")
    assert human.asked[0].startswith("drive: make this fault: its supply is cut (power_off)")


def test_at_a_real_port_the_last_frame_ends_by_the_gap() -> None:
    now_us, heard = [0], list[bytes]()
    record = PortRecord(PLAN, {}, lambda: now_us[0])
    journal = DoorJournal(lambda: now_us[0], lambda: None, record)
    journal.listeners.append(lambda line: heard.append(line.data))
    hear = journal.of_line("line", by_gap("2ms"))
    hear(1_000, Mark.FROM_DEVICE, b"\x01\x02")
    now_us[0] = 2_000
    assert [line.data for line in journal.lines()] == [b"0102"]
    assert heard == []  # it may go on
    now_us[0] = 3_000
    journal.look()
    assert heard == [b"0102"]
    assert [line.data for line in journal.lines()] == [b"0102"]


def told(bench: Bench) -> list[str]:
    return [line.partition(" can ")[2] for line in bench.transcript().splitlines()]


def test_a_frame_that_two_doors_see_is_told_once(bench: Bench, drive: can.BusABC) -> None:
    first, second, third = bench.can_bus(), bench.link, bench.can_bus()
    boots = bench.on_line("705#*", nth=3)
    for _ in range(2):
        drive.send(BOOT_UP)
        assert first.recv(1) is not None
    assert second.receive(0) == (CanFrame(0x705, b"\0"),) * 2
    assert third.recv(0) is not None
    assert (told(bench), boots()) == (["< 705#00"] * 2, False)
    drive.send(BOOT_UP)
    assert third.recv(0) is not None  # the second of those before
    assert not boots()
    assert second.receive(0) == (CanFrame(0x705, b"\0"),)
    assert boots()
    assert (first.recv(1) is not None, third.recv(0) is not None) == (True, True)
    assert told(bench) == ["< 705#00"] * 3


@pytest.mark.parametrize("doors", [["can_bus"], ["link"], ["link", "can_bus"]])
def test_an_error_frame_is_told_once_and_is_in_no_trace(
    bench: Bench, drive: can.BusABC, doors: list[str], tmp_path: Path
) -> None:
    hosts = [bench.can_bus() if door == "can_bus" else bench.link for door in doors]
    drive.send(STUFF_ERROR)
    for host in hosts:
        if isinstance(host, can.BusABC):
            message = host.recv(0)
            assert message is not None
            assert message.is_error_frame
        else:
            assert host.receive(0) == ()
    assert told(bench) == ["< 20000088#0000040000000000"]
    bench.save_trace(tmp_path / "run.trace")
    assert "#" not in (tmp_path / "run.trace").read_text().partition("\n")[2]


def test_what_a_host_sends_is_no_answer_at_another_door(bench: Bench, drive: can.BusABC) -> None:
    first, second = bench.can_bus(), bench.can_bus()
    first.send(START)
    assert second.recv(0) is not None
    assert told(bench) == ["> 000#0105"]
    drive.send(START)  # another host, not on the bench
    assert (first.recv(0) is not None, second.recv(0) is not None) == (True, True)
    assert told(bench) == ["> 000#0105", "< 000#0105"]


def test_what_was_not_sent_is_not_known_elsewhere(
    bench: Bench, drive: can.BusABC, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = bench.can_bus(), bench.can_bus()

    def fail(*arguments: object, **options: object) -> None:
        raise can.CanOperationError("buffer full")

    with monkeypatch.context() as patch:
        patch.setattr(VirtualBus, "send", fail)
        with pytest.raises(can.CanOperationError):
            first.send(START)
    drive.send(START)
    assert second.recv(0) is not None
    assert told(bench) == ["< 000#0105"]
