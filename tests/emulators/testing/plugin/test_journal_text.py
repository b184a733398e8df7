"""What a report says of the frames of a bench."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import canopen
import pytest

from tests.host.canopen.master.joints import cell
from tickrig import Bench, open_bench
from tickrig.emulators.testing.bench import bench_rig as journal
from tickrig.emulators.testing.plugin.journal_text import last_lines


def test_what_pdos_carry_is_known_after_their_mapping_is_dropped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal, "_KEPT", 200)
    with cell(tmp_path) as drives:
        drives.master.run_for("2s")
        text = last_lines(drives.bench, 60)
    pdos = [line for line in text.splitlines() if " 182#" in line]
    assert pdos
    assert "mapping unknown" not in text
    assert all("Statusword" in line or "statusword" in line for line in pdos), pdos[0]


def test_frames_of_a_node_are_decoded_by_its_own_objects() -> None:
    with Bench(left="1=epos", right="2=epos", io="3=f-palette") as bench:
        network = bench.canopen_network()
        network.add_node(1, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        bench.run_for("10ms")
        network[1].nmt.state = "OPERATIONAL"
        bench.run_for("10ms")
        network[1].sdo.download(0x6040, 0, b"\x06\0")
        text = last_lines(bench, 60)
    assert "statusword=0x0350[switch on disabled] position_actual_value=0" in text
    assert "download 6040h:00 controlword = 0x0006" in text


def test_nodes_with_one_node_id_on_two_buses_are_decoded_by_the_standard_alone(
    tmp_path: Path,
) -> None:
    rig = tmp_path / "rig.toml"
    rig.write_text(
        '[wire.a]\ntype = "can"\n[wire.b]\ntype = "can"\n'
        '[device.x]\ntype = "epos"\nnode_id = 1\nwire = "a"\n'
        '[device.y]\ntype = "f-palette"\nnode_id = 1\nwire = "b"\n',
        "utf-8",
    )
    with open_bench(rig) as bench:
        bench.run_for("10ms")
        text = last_lines(bench, 60)
    assert "a < 701#00  boot-up" in text
    assert "b < 701#00  boot-up" in text


@pytest.mark.parametrize("fault", ["drop", "unplugged", "corrupt", "sdo_mute"])
def test_what_a_fault_did_to_a_frame_is_shown_beside_frames(fault: str) -> None:
    with Bench("epos") as bench:
        network = bench.canopen_network()
        network.add_node(1, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        bench.fault(fault, for_="500ms")
        with suppress(canopen.SdoCommunicationError):
            network[1].sdo.upload(0x1000, 0)
        lines = last_lines(bench, 99).splitlines()
    marked = [line for line in lines if " ~ " in line]
    assert bool(marked) == (fault == "drop"), lines
