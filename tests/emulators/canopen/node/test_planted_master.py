"""Mistakes of a CANopen master, found by a search with faults of one node."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.emulators.canopen.node.planted import MISTAKES, Supervision
from tickrig.testing import check_host, replay_host

pytestmark = pytest.mark.release  # a minute of searches

FAULTS = {
    "no_timeout": ("sdo_mute", "sdo_slow"),
    "abort_as_data": ("sdo_abort", "sdo_busy"),
    "toggle_ignored": ("sdo_twice",),
    "late_answer_believed": ("sdo_slow",),
    "emcy_ignored": ("emcy_storm",),
    "heartbeat_loss_unseen": ("bus_off",),
    "boot_up_as_heartbeat": ("boots_again",),
    "restart_race": ("boot_late",),
    "old_cob_id": (),
    "lost_sync_unseen": ("sync_lost",),
    "stale_statusword": ("pdo_mute",),
    "not_used_again": ("bus_off",),
}


def machine(mistake: str, folder: Path, faults: tuple[str, ...]) -> type[Supervision]:
    names = tuple(f"axis2/{name}" for name in faults)
    return type("Machine", (Supervision,), {"mistake": mistake, "folder": folder, "faults": names})


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_of_a_master_is_found_in_at_most_four_steps(mistake: str, tmp_path: Path) -> None:
    with pytest.raises(BaseException) as caught:  # noqa: PT011 - what an invariant or hang raises
        check_host(machine(mistake, tmp_path, FAULTS[mistake]), seed=1, max_examples=200)
    note = next(each for each in caught.value.__notes__ if "a scenario of" in each)
    steps = [line for line in note.splitlines() if line.lstrip().startswith("+")]
    assert 1 <= len(steps) <= 4, note
    scenario = note.partition("\n\n")[0]
    with pytest.raises(type(caught.value)) as again:
        replay_host(machine(mistake, tmp_path, FAULTS[mistake]), scenario)
    assert "# " + again.value.__notes__[-1].partition("\n")[0] == scenario.splitlines()[-1]


def test_a_master_without_mistakes_passes(tmp_path: Path) -> None:
    faults = tuple(sorted({name for names in FAULTS.values() for name in names}))
    check_host(machine("", tmp_path, faults), seed=1, max_examples=60)
