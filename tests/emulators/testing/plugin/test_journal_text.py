"""What a report says of the frames of a bench."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import canopen
import pytest

from tests.host.canopen.master.joints import cell
from tickrig import Bench
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
