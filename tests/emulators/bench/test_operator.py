from __future__ import annotations

import pytest

from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.serial.emulator import Emulator


def run_to(emulator: Emulator, t_us: int) -> None:
    emulator.event_queue.put("pause", t_us, lambda now_us: None)
    while emulator.rig.now_us < t_us - 1:
        emulator.step()


def said(emulator: Emulator) -> list[bytes]:
    return [line.data for line in emulator.log.since(0)]


def test_a_group_is_set_whole(emulator: Emulator) -> None:
    emulator.operator.set("place", 3, -4)
    assert (emulator.device.inputs["x_mm"], emulator.device.inputs["y_mm"]) == (3, -4)


def test_a_group_is_not_set_by_halves(emulator: Emulator) -> None:
    with pytest.raises(ValueError, match=r"y_mm 11 is not in -10\.\.10 mm"):
        emulator.operator.set("place", 3, 11)
    assert emulator.device.inputs["x_mm"] == 0


@pytest.mark.parametrize(
    ("name", "values", "error"),
    [
        ("plce", (1,), "no input 'plce'; did you mean 'place'"),
        ("place", (1,), r"place takes 2 values \(x_mm, y_mm\), got 1"),
        ("lamp", (), "lamp takes one value"),
        ("lamp", (2,), r"lamp 2 is not in 0\.\.1"),
    ],
)
def test_a_bad_setting_says_what_is_allowed(
    emulator: Emulator, name: str, values: tuple[int, ...], error: str
) -> None:
    with pytest.raises(ValueError, match=error):
        emulator.operator.set(name, *values)


def test_a_press_ends_by_itself(emulator: Emulator) -> None:
    run_to(emulator, 5_000)
    emulator.operator.press(5_000, "key", 3_000)
    run_to(emulator, 7_999)
    assert emulator.device.inputs["key"] == 1
    run_to(emulator, 8_000)
    assert emulator.device.inputs["key"] == 0
    assert said(emulator) == [b"hi", b"click"]


@pytest.mark.parametrize("at_us", [5_000, 5_001, 5_500, 5_999])
def test_a_press_is_seen_however_short(emulator: Emulator, at_us: int) -> None:
    emulator.event_queue.put("p", at_us, lambda now_us: emulator.operator.press(now_us, "key", 1))
    run_to(emulator, 9_000)
    assert said(emulator) == [b"hi", b"click"]
    assert emulator.device.inputs["key"] == 0


def test_a_second_press_starts_the_time_anew(emulator: Emulator) -> None:
    emulator.operator.press(0, "key", 5_000)
    run_to(emulator, 3_000)
    emulator.operator.press(3_000, "key", 5_000)
    run_to(emulator, 7_000)
    assert emulator.device.inputs["key"] == 1


def test_a_button_that_is_set_stays(emulator: Emulator) -> None:
    emulator.operator.press(0, "key", 5_000)
    emulator.operator.set("key", 1)
    run_to(emulator, 9_000)
    assert emulator.device.inputs["key"] == 1
    emulator.operator.release("key")
    assert emulator.device.inputs["key"] == 0


def test_only_buttons_are_pressed(emulator: Emulator) -> None:
    with pytest.raises(ValueError, match="no button 'lamp'; known: key"):
        emulator.operator.press(0, "lamp")
    with pytest.raises(ValueError, match="at least 1 us, not 0 us"):
        emulator.operator.press(0, "key", 0)


def test_faults_come_and_go_in_time(emulator: Emulator) -> None:
    for text in ("dead@5ms-7ms", "cut@6ms"):
        emulator.operator.fault(0, parse_fault_spec(text))
    seen = []
    for t_us in (4_000, 5_002, 6_002, 7_002):
        run_to(emulator, t_us)
        seen.append(emulator.operator.active_faults)
    assert seen == [(), ("dead",), ("cut", "dead"), ("cut",)]
    emulator.operator.clear("cut")
    assert emulator.operator.active_faults == ()


@pytest.mark.parametrize(
    ("orders", "told"),
    [
        (["cut@1ms-2ms", "cut@4ms-5ms"], "1 cut, 2 cut=0, 4 cut, 5 cut=0"),
        (["cut@4ms-5ms", "cut@1ms-2ms"], "1 cut, 2 cut=0, 4 cut, 5 cut=0"),
        (["cut@1ms-2ms", "cut@2ms-3ms"], "1 cut, 2 cut, 3 cut=0"),
        (["cut@2ms-3ms", "cut@1ms-2ms"], "1 cut, 2 cut, 3 cut=0"),
        (["cut@1ms-4ms", "cut@3ms-5ms"], "3 cut, 5 cut=0"),
        (["cut@1ms", "cut@3ms-5ms"], "3 cut, 5 cut=0"),
        (["dead@1ms-2ms", "dead@4ms"], "1 dead=1, 2 dead=0, 4 dead=1"),
    ],
)
def test_a_fault_may_come_again_and_again(emulator: Emulator, orders: list[str], told: str) -> None:
    notes: list[str] = []
    emulator.operator.note = lambda text: notes.append(f"{emulator.effective_us // 1_000} {text}")
    for order in orders:
        emulator.operator.fault(0, parse_fault_spec(order))
    run_to(emulator, 8_000)
    assert ", ".join(notes) == told


def test_clearing_a_fault_forgets_its_future(emulator: Emulator) -> None:
    emulator.operator.fault(0, parse_fault_spec("dead@5ms"))
    emulator.operator.clear("dead")
    run_to(emulator, 9_000)
    assert emulator.operator.active_faults == ()


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("x", "no fault 'x'; known: flip, drop, dup, cut, .*parity, dead"),
        ("lamp", "no fault 'lamp'"),
        ("dead=0.1", "dead takes no argument, got 0.1$"),
        ("dead=0", "dead takes no argument, got 0; clear ends it"),
        ("dead@0-1us", "would have ended before now"),
    ],
)
def test_a_bad_fault_is_refused(emulator: Emulator, text: str, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        emulator.operator.fault(1, parse_fault_spec(text))
    with pytest.raises(ValueError, match="no fault"):
        emulator.operator.clear("x")
