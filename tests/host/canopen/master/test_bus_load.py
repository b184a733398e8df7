"""How much of a bus drives take, worked out from the file, and as it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canopen.master.joints import MASTER, NO_PDOS, PDOS, eds
from tickrig import open_bench
from tickrig.host.canopen.bus_file.bus_file import BusFile, read_bus_file
from tickrig.host.canopen.master.cia402.bus_load import check_load, pdo_load, polling_load
from tickrig.testing import open_master
from tickrig.wire.can import CanFrame, frame_bits

SECOND_US = 1_000_000


def bus(folder: Path, drives: int, pdos: str = NO_PDOS, master: str = MASTER) -> BusFile:
    (folder / "drive.eds").write_text(eds())
    nodes = "".join(f"  joint{node}: {{node_id: {node}}}\n" for node in range(2, 2 + drives))
    (folder / "bus.yml").write_text(f"{master}{pdos}nodes:\n{nodes}")
    return read_bus_file(folder / "bus.yml")


def test_drives_without_pdos_fill_a_bus(tmp_path: Path) -> None:
    (one,) = check_load(bus(tmp_path, 6))
    assert one.text == (
        "1000 kbit/s: 103% of the bus in each period:"
        " polling of 6 drives by SDO 103%, PDOs 0%; 80% is enough for 4 of them"
    )
    assert one.line == 2


def test_pdos_alone_can_be_too_much(tmp_path: Path) -> None:
    text = MASTER.replace("Cia402Driver", "ProxyDriver").replace("10000", "5000")
    (one,) = check_load(bus(tmp_path, 32, PDOS, text))
    assert one.text == "1000 kbit/s: 129% of the bus in each period for PDOs"


@pytest.mark.parametrize(
    ("drives", "pdos", "old", "new"),
    [
        (4, NO_PDOS, "", ""),
        (8, NO_PDOS, "  period: 10\n", "  period: 20\n"),
        (6, NO_PDOS, "  period: 10\n", "  polling: false\n  period: 1\n"),
        (6, NO_PDOS, "  period: 10\n", "  boot: false\n"),
        (6, NO_PDOS, "Cia402Driver", "ProxyDriver"),
        (12, PDOS, "", ""),
    ],
)
def test_what_a_bus_can_carry_is_not_told(
    tmp_path: Path, drives: int, pdos: str, old: str, new: str
) -> None:
    master = MASTER.replace(old, new)
    if "polling" in new:
        master = master.replace("sync_period: 10000", "sync_period: 20000")
    assert check_load(bus(tmp_path, drives, pdos, master)) == ()


def test_a_slower_bus_carries_less(tmp_path: Path) -> None:
    master = MASTER.replace("sync_period", "baudrate: 250\n  sync_period")
    assert check_load(bus(tmp_path, 1, NO_PDOS, master)) == ()
    (one,) = check_load(bus(tmp_path, 2, NO_PDOS, master))
    assert one.text.startswith("250 kbit/s: 137% of the bus")


def test_no_master_asks_for_nothing(tmp_path: Path) -> None:
    assert check_load(bus(tmp_path, 9, master="defaults:\n  dcf: drive.eds\n")) == ()


@pytest.mark.parametrize("pdos", [NO_PDOS, PDOS])
def test_the_bus_carries_what_was_worked_out(tmp_path: Path, pdos: str) -> None:
    file = bus(tmp_path, 1, pdos + "  sdo: [{index: 0x6098, value: 35}]\n")
    slave, path = file.slaves["joint2"], file.path
    assert file.master is not None
    worked_out = polling_load(slave, file.master) + pdo_load(slave, file.master)
    with open_bench(path) as bench, open_master(bench.link, path) as master:
        master.boot()
        joint = master.joints["joint2"]
        master.perform(joint.init())
        master.perform(joint.choose("csp"))
        joint.set_target(0.0)
        master.run_for("100ms")
        before = len(bench.transcript().splitlines())
        master.run_for("1s")
        lines = bench.transcript().splitlines()[before:]
    frames = [CanFrame.parse(line.split()[-1]) for line in lines]
    bits = sum(frame_bits(frame) for frame in frames if 0x180 <= frame.can_id < 0x700)
    assert bits / SECOND_US == pytest.approx(worked_out, rel=0.05)
