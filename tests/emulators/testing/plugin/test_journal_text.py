"""What a report says of the frames of a bench."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canopen.master.joints import cell
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
