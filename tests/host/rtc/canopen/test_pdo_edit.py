"""Changing PDOs of a node: the order on the bus, what a refusal leaves, what files contain."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import EDS, Bench
from tickrig.host.rtc.canopen import pdo_edit
from tickrig.host.rtc.canopen.definition import ServerRefused, read_device_file
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.view import PendingTransfer, ServerView
from tickrig.wire.canopen.pdo import PdoDescription

MAPPED = PdoDescription(0x1A5, (0x6401_0510, 0x6401_0610), 254, relative=False)


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.boot()
    return bench


def pdos_of(bench: Bench, node_id: int = 16) -> pdo_edit.Pdos:
    reading = ServerView(bench.server).read_pdos(node_id)
    bench.run_ms(300)
    assert reading.done
    return reading.data


def write(bench: Bench, wanted: pdo_edit.Pdos, node_id: int = 16) -> PendingTransfer[None]:
    writing = ServerView(bench.server).write_pdos(node_id, pdos_of(bench, node_id), wanted)
    bench.run_ms(800)
    assert writing.done
    return writing


def downloads(bench: Bench, node_id: int) -> list[str]:
    """Return the expedited SDO downloads to a node as `1800:01 90010080`."""
    sent = re.findall(rf"{0x600 + node_id:03X}#(2[3BF7]\w+)", bench.log.text)
    return [f"{data[4:6]}{data[2:4]}:{data[6:8]} {data[8:]}" for data in sent]


def test_it_is_written_in_the_order_of_cia_301(bench: Bench) -> None:
    before = pdos_of(bench)
    done = len(downloads(bench, 16))
    assert write(bench, {0x1800: MAPPED}).problem == ""
    assert before[0x1800].cob_id == 0x190
    assert downloads(bench, 16)[done : done + 8] == [
        "1800:01 90010080",  # off, with the CAN-ID that it has
        "1800:01 A5010080",
        "1A00:00 00000000",
        "1A00:01 10050164",
        "1A00:02 10060164",
        "1A00:00 02000000",
        "1800:02 FE000000",
        "1800:01 A5010000",
    ]
    assert pdos_of(bench)[0x1800] == MAPPED


def test_all_are_as_before_if_the_node_refuses_one_of_several(bench: Bench) -> None:
    before = pdos_of(bench)
    bad = PdoDescription(0x290, (0x6200_0108,), relative=False)  # an output in a TPDO
    writing = write(bench, {0x1800: MAPPED, 0x1801: bad})
    assert writing.problem == (
        "1A01h:01 refused: object cannot be mapped (06040041h); the old values are back"
    )
    assert pdos_of(bench) == before
    assert bench.server.nodes[16].entry.pdos == {}


def test_another_node_is_not_touched_and_an_active_one_is_active_again(bench: Bench) -> None:
    bench.activate()
    done = len(downloads(bench, 32))
    assert write(bench, {0x1800: MAPPED}).problem == ""
    assert downloads(bench, 32)[done:] == []
    assert [bench.state(n).name for n in (16, 32) if bench.state(n)] == ["ACTIVE", "ACTIVE"]  # type: ignore[union-attr]


def test_a_node_keeps_what_was_changed_over_a_reset(bench: Bench) -> None:
    write(bench, {0x1800: MAPPED})
    ServerView(bench.server).restart(16)
    bench.run_ms(1_500)
    assert pdos_of(bench)[0x1800] == MAPPED


def test_a_node_that_is_not_there_is_refused(bench: Bench) -> None:
    there = pdos_of(bench)
    bench.devices[16].physical["unplugged"].write(1)
    bench.run_ms(450)
    view = ServerView(bench.server)
    with pytest.raises(ServerRefused, match="node 16 is not ready"):
        view.write_pdos(16, there, {0x1800: MAPPED})
    with pytest.raises(ServerRefused, match="node 9 is not one of: 16, 32"):
        view.read_pdos(9)


def test_a_stopped_node_is_refused(bench: Bench) -> None:
    bench.other.send(frames("000#0210"))
    bench.run_ms(300)
    with pytest.raises(ServerRefused, match="node 16 is Stopped: reset it first"):
        ServerView(bench.server).read_pdos(16)


def test_a_dcf_of_another_device_is_refused(bench: Bench, tmp_path: Path) -> None:
    there = pdos_of(bench, 32)
    dcf = tmp_path / "motor.dcf"
    pdo_edit.save_dcf(dcf, EDS / "motor-core-unit.eds", 32, 1_000_000, {})
    palette = read_device_file(EDS / "f-palette.eds")
    with pytest.raises(ValueError, match=r"another device: 1000h:00 is 000C0191h, not 00070191h"):
        pdo_edit.pdos_of_dcf(dcf, 16, palette, pdos_of(bench, 16))
    assert pdo_edit.pdos_of_dcf(dcf, 32, read_device_file(EDS / "motor-core-unit.eds"), there) == {}


def test_what_may_be_mapped_is_as_the_eds_has_it() -> None:
    file = read_device_file(EDS / "f-palette.eds")
    sent = [f"{one.mapped.encode():08X}" for one in pdo_edit.mappable(file, 0x1800)]
    taken = [one.name for one in pdo_edit.mappable(file, 0x1400)]
    assert sent[:3] == ["10010008", "60000108", "64010110"]
    assert len(sent) == 10
    assert taken == ["Write output 8-bit 1", *(f"dummy: {bits} bits" for bits in (1, 8, 16, 32))]


@pytest.mark.parametrize("number", ["0x180", "0x6E0", "0xA0000290", "0x80000000"])
def test_a_definition_takes_a_cob_id_with_its_flags_and_no_other(number: str) -> None:
    text = "nodes: [{{id: 1, name: A, eds: a.eds, pdos: {{tpdo1: {{cob_id: {}}}}}}}]"
    read = parse_definition(text.format("0xC0000290")).nodes[0].pdos["tpdo1"]
    assert read.cob_id == 0xC000_0290
    with pytest.raises(ValueError, match="line 1: "):
        parse_definition(text.format(number))
