"""What shows two nodes of one node-ID, message by message."""

from __future__ import annotations

import pytest

from tickrig.host.rtc.canopen.served_node import CROWDED, DuplicateNodeDetector
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

MS = 1_000
BOOT_UP, PRE_OPERATIONAL = NmtState.INITIALISING, NmtState.PRE_OPERATIONAL


def watched(
    before_ms: tuple[int, ...], boot_ms: int, after_ms: tuple[int, ...]
) -> DuplicateNodeDetector:
    """Heartbeats, a boot-up that nobody asked for, and heartbeats."""
    watch = DuplicateNodeDetector(100 * MS)
    for at_ms in before_ms:
        watch.receive(at_ms * MS, PRE_OPERATIONAL, listening=False)
    watch.receive(boot_ms * MS, BOOT_UP, listening=False)
    for at_ms in after_ms:
        watch.receive(at_ms * MS, PRE_OPERATIONAL, listening=True)
    return watch


@pytest.mark.parametrize(
    ("before_ms", "boot_ms", "after_ms", "duplicates"),
    [
        ((100, 200), 240, (300, 400), True),
        ((100, 200), 240, (340, 440), False),  # it booted itself
        ((100, 200), 240, (300,), False),  # once is chance
        ((100, 200), 240, (300, 340, 400), True),
        ((100, 200), 540, (600, 700), False),  # it was silent before: held up, or off
        ((100, 201, 202), 240, (302, 402), False),  # it was held up before
        ((200,), 240, (300, 400), False),  # its times are not known
    ],
)
def test_a_twin_goes_on_at_its_times_when_the_other_boots(
    before_ms: tuple[int, ...], boot_ms: int, after_ms: tuple[int, ...], duplicates: bool
) -> None:
    assert bool(watched(before_ms, boot_ms, after_ms).sign) is duplicates


def test_while_there_is_a_stranger_it_is_listened_for_longer() -> None:
    assert watched((100, 200), 240, ()).sure_us == 365 * MS
    assert watched((100, 200), 240, (300,)).sure_us == 425 * MS


@pytest.mark.parametrize(
    ("states", "duplicates"),
    [
        ("OPERATIONAL PRE_OPERATIONAL OPERATIONAL PRE_OPERATIONAL OPERATIONAL", True),
        ("STOPPED PRE_OPERATIONAL STOPPED PRE_OPERATIONAL", True),
        ("OPERATIONAL PRE_OPERATIONAL OPERATIONAL PRE_OPERATIONAL STOPPED", False),
        ("OPERATIONAL INITIALISING OPERATIONAL INITIALISING OPERATIONAL", False),  # starts itself
    ],
)
def test_states_that_no_command_explains_show_twins_at_the_second_time(
    states: str, duplicates: bool
) -> None:
    watch = DuplicateNodeDetector(100 * MS)
    for place, word in enumerate(states.split()):
        watch.receive(100 * MS * place, NmtState[word], listening=False)
    assert bool(watch.sign) is duplicates


def test_states_that_were_commanded_show_nothing_however_late_they_come() -> None:
    watch = DuplicateNodeDetector(100 * MS)
    for command in (NmtCommand.START, NmtCommand.ENTER_PRE_OPERATIONAL) * 3:
        watch.command(command)
    for place in range(6):
        state = (NmtState.OPERATIONAL, PRE_OPERATIONAL)[place % 2]
        watch.receive(5_000 * MS + place, state, listening=False)
    assert watch.sign == ""


def test_two_heartbeats_in_each_producer_time_are_a_suspicion_and_a_burst_is_none() -> None:
    watch = DuplicateNodeDetector(100 * MS)
    for place in range(2 * CROWDED):
        watch.receive(50 * MS * place, PRE_OPERATIONAL, listening=False)
    assert watch.suspicion == ""
    for place in range(2 * CROWDED, 2 * CROWDED + 4):
        watch.receive(50 * MS * place, PRE_OPERATIONAL, listening=False)
    assert watch.suspicion == "two heartbeats in each 100 ms"
    held_up = DuplicateNodeDetector(100 * MS)
    for place in range(1_000):
        held_up.receive(100 * MS * (place // 50 * 50) + place, PRE_OPERATIONAL, listening=False)
    assert (held_up.suspicion, held_up.sign) == ("", "")
