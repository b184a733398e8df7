"""The table of commands on the RRC's page is that of the code, and what the emulator answers."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import groupby
from operator import methodcaller
from pathlib import Path

from tickrig import Bench
from tickrig.host import RrcClient
from tickrig.wire.rrc.commands import COMMANDS, Command, Parameter, parse_command
from tickrig.wire.rrc.message import PACE_WITHOUT_VR2, check_digit, pace_lines_s
from tickrig.wire.rrc.replies import Event, RrcEvent

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "devices" / "rrc.md"


def rows() -> dict[str, tuple[str, str, str, str]]:
    """Return what the page says of each command: digits, ranges, an example, its answer."""
    table = PAGE.read_text("utf-8").partition("| command |")[2].partition("\n\n")[0]
    cells = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
    return {c[0].strip("`"): (c[1], c[2], c[3].strip("`"), c[4]) for c in cells}


def ranges(kind: type[Command]) -> str:
    """Write the ranges of a command, equal neighbours once."""
    runs = groupby(kind.parameters, lambda each: (each.width, each.low, each.high))
    return ", ".join(span(same[0], len(same)) for same in ([*run] for _, run in runs)) or "-"


def span(parameter: Parameter, count: int) -> str:
    times = f"{count} x " if count > 1 else ""
    return f"{times}{parameter.low}..{parameter.high}"


def answer(line: bytes) -> str:
    """Return what an RRC that is on answers, without its stream and its events."""
    with Bench("rrc") as bench:
        bench.run_for("1s")
        bench.press("power_button")
        bench.run_for("1s")
        link = bench.link
        link.receive(0)
        link.send(line + b"\n")
        bench.run_for("50ms")
        heard: bytes = link.receive(0)
        lines = heard.decode().splitlines()
        return ", ".join(f"`{one}`" for one in lines if not one.startswith(("SA:", "EV:")))


def test_the_table_has_each_command_with_its_digits_and_ranges() -> None:
    said = {name: cells[:2] for name, cells in rows().items()}
    assert said == {
        (name + kind.literal).decode(): (
            "+".join(str(each.width) for each in kind.parameters) or "-",
            ranges(kind),
        )
        for name, kind in COMMANDS.items()
    }


def test_each_example_is_that_command_and_is_answered_as_it_says() -> None:
    for name, (_, _, example, answered) in rows().items():
        line = example.encode()
        assert name.startswith(parse_command(line).name.decode())
        assert answer(line) == answered, name


def test_the_table_of_paces_is_that_of_the_code() -> None:
    table = PAGE.read_text("utf-8").partition("| VR2 | stablemode |")[2].partition("\n\n")[0]
    rows = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
    said = {(c[0], c[1], c[2]): (int(c[3]), float(c[4].removesuffix(" ms"))) for c in rows[:4]}
    paces = {
        ("runs", stable, status): pace_lines_s(stable=stable == "on", status=status == "on")
        for stable in ("on", "off")
        for status in ("on", "off")
    }
    assert {key: pace for key, (pace, _) in said.items()} == paces
    for pace, line_ms in said.values():
        assert line_ms == round(1_000 / pace, 2)
    assert rows[4][3:] == [str(PACE_WITHOUT_VR2), f"{1_000 / PACE_WITHOUT_VR2:.1f} ms"]


def test_ctl_and_client_tell_load_and_pace_as_the_page_shows() -> None:
    """A host at its full pace, with CHECK and status lines."""
    page = PAGE.read_text("utf-8")
    shown = page.partition("get load_pct margin_pct backlog_pct pace_lines_s\n")[2]
    said = dict(line.split() for line in shown.partition("```")[0].splitlines())
    with Bench("rrc") as bench:
        bench.run_for("1s")
        bench.press("power_button")
        bench.run_for("1s")
        client = RrcClient(bench.link)
        client.start()
        client.status()
        client.stablemode()
        client.run_for(100_000)
        until_us = client.now_us + 1_000_000
        while client.now_us < until_us:
            client.output(1, 0)
        assert {name: str(bench.get(name)) for name in said} == said
        assert f"{client.load!r}" in page


def test_the_example_of_check_is_right() -> None:
    found = re.findall(r"`(\w+)` has CHECK `([0-9A-F])`", PAGE.read_text("utf-8"))
    assert found
    for line, check in found:
        assert check_digit(line.encode()) == check.encode()


def test_the_supply_and_its_warning_stand_there() -> None:
    page = " ".join(PAGE.read_text("utf-8").split())
    assert "24 V, 6.5 mA from the VR2 battery, or 5 V, 20 mA from USB" in page
    assert "Do not plug an RRC that is fed from the VR2 battery into a USB port" in page


FAULTS = {
    "PowerOnError1": "bus_noise joystick_fault",
    "PowerOnError2": "power_module_fault vr2_fault",
    "PowerOnTimeout": "bus_unplugged",
    "PowerOffWaitByCommunicationError": "bus_noise",
    "PowerOffWaitByJoystickModuleError": "joystick_fault",
    "PowerOffWaitByPowerModuleError": "power_module_fault",
    "PowerOffWaitBySystemError": "vr2_fault",
    "PowerOffWaitByNoCommunication": "bus_unplugged",
}
"""Events that the page explains by faults alone, with these faults."""


def event_rows() -> dict[str, tuple[str, str]]:
    """Return what the page says of each event: its cause, and the state after it."""
    table = PAGE.read_text("utf-8").partition("| event | when |")[2].partition("\n\n")[0]
    cells = [line.strip("| ").split(" | ") for line in table.splitlines()[2:]]
    return {name.strip("`"): (when, state) for name, when, state in cells}


def press(bench: Bench) -> None:
    bench.press("power_button")


def play(*acts: Callable[[Bench], object]) -> dict[str, str]:
    """Do one act after the other, and return the events, each with the state of its tick."""
    found = dict[str, str]()
    with Bench("rrc") as bench:
        bench.run_for("5ms")  # between two ticks
        for act in (None, *acts):
            if act is not None:
                act(bench)
            for _ in range(400):
                bench.run_for("10ms")
                for line in bench.link.receive(0).decode().splitlines():
                    if line.startswith("EV:"):
                        found[line.removeprefix("EV:")] = str(bench.get("state"))
    return found


def test_the_table_of_events_is_that_of_the_device() -> None:
    found = play(press, press)
    found |= play(press, lambda bench: bench.link.send(b"poweroff\n"))
    found |= play(press, lambda bench: bench.link.send(b"watchdog03\n"))
    found |= play(press, lambda bench: bench.link.send(b"device\n" * 60))
    for name, faults in FAULTS.items():
        for fault in faults.split():
            act = methodcaller("fault", fault)
            events = play(act, press) if "PowerOn" in name else play(press, act)
            assert name in events, fault
            found |= events
    page = event_rows()
    assert {name: state for name, (_, state) in page.items()} == found
    assert {Event(name).kind for name in page} == {*RrcEvent}
    for name, faults in FAULTS.items():
        assert re.findall(r"`(\w+)`", page[name][0]) == faults.split()
