"""`tickrig doctor` on this machine, whatever it has."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from threading import Event

import pytest
from click.testing import CliRunner

from tickrig.emulators.commands import doctor
from tickrig.emulators.commands.cli import main
from tickrig.emulators.commands.doctor import _CheckRow as CheckRow
from tickrig.emulators.commands.doctor import _CheckState as CheckState

PAGE = Path(__file__).parents[3] / "docs/howto/doctor.md"


def run(*words: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(main, ["doctor", *words])
    return result.exit_code, result.stdout, result.stderr


def row(name: str = "thing", state: CheckState = CheckState.OK, found: str = "") -> CheckRow:
    return CheckRow(name, state, found, "do it" if state is CheckState.MISSING else "")


def probing(monkeypatch: pytest.MonkeyPatch, *rows: CheckRow) -> None:
    monkeypatch.setattr(doctor, "_PROBES", (doctor._Probe("thing", lambda: iter(rows)),))


@pytest.fixture(scope="module")
def this_machine() -> tuple[int, str]:
    """Look at all of it once: that takes seconds."""
    return run("--json")[:2]


def test_this_machine_has_what_is_needed_and_each_row_says_what_to_do(
    this_machine: tuple[int, str],
) -> None:
    status, out = this_machine
    found = json.loads(out)
    assert (status, found["ok"], found["missing"]) == (0, True, [])
    checks = {check["name"]: check for check in found["checks"]}
    assert [name for name, check in checks.items() if check["needed"]] == [
        *("python", "packages", "terminals")
    ]
    for check in found["checks"]:
        assert check["state"] in ("ok", "note", "missing")
        assert check["found"]
        assert check["do"] or check["state"] != "missing"
    assert re.search(r"pyserial [0-9.]+", checks["packages"]["found"])
    assert "extra test" in checks
    assert "of 500 wake-ups" in checks["real time"]["found"]


def test_every_extra_of_the_package_has_a_row() -> None:
    try:
        extras = metadata("tickrig").get_all("Provides-Extra") or []
    except PackageNotFoundError:
        pytest.skip("it is not installed")
    names = {each.name for each in doctor._packages()}
    assert names == {"packages", *(f"extra {extra}" for extra in extras)}


def test_the_checks_are_those_of_the_page(this_machine: tuple[int, str]) -> None:
    names = {check["name"] for check in json.loads(this_machine[1])["checks"]}
    table = PAGE.read_text("utf-8").partition("## The checks")[2]
    named = set(re.findall(r"`([a-z]+(?: [A-Za-z]+)?)`", table))
    assert {re.sub("^extra .*", "extra NAME", name) for name in names} <= named


def test_what_is_needed_and_missing_is_exit_status_1(monkeypatch: pytest.MonkeyPatch) -> None:
    probing(monkeypatch, row(state=CheckState.MISSING), row("extra tui", CheckState.MISSING))
    assert run()[0] == 0
    status, out, _ = run("--need", "tui", "--need", "thing")
    assert (status, out.splitlines()[-1]) == (1, "missing, and needed: thing, extra tui")
    assert "-> do it" in out
    status, out, _ = run("--json", "--need", "tui")
    assert (status, json.loads(out)["missing"]) == (1, ["extra tui"])


def test_one_of_several_ports_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    ports = [row("serial port", CheckState.MISSING), row("serial port")]
    probing(monkeypatch, *ports)
    assert run("--need", "serial port")[0] == 0
    probing(monkeypatch, row("serial port", CheckState.NOTE))
    assert run("--need", "serial port")[0] == 1


def test_a_need_that_is_no_check_is_refused_with_near_words() -> None:
    status, out, err = run("--need", "sockectan")
    assert (status, out) == (2, "")
    assert err.strip() == "Error: --need: no check 'sockectan'; did you mean 'socketcan'?"


def test_a_check_that_hangs_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    hanging = Event()

    def look() -> Iterator[CheckRow]:
        hanging.wait()
        yield row()

    monkeypatch.setattr(doctor, "_PROBES", (doctor._Probe("driver", look, 0.01),))
    status, out, _ = run()
    hanging.set()
    assert (status, out.splitlines()[0]) == (0, "note     driver  no answer within 0.01 s")


def test_a_check_that_fails_has_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def look() -> Iterator[CheckRow]:
        yield row("first")
        raise OSError("broken")

    monkeypatch.setattr(doctor, "_PROBES", (doctor._Probe("driver", look),))
    out = run()[1].splitlines()
    assert out[:2] == ["ok       first", "note     driver  the check failed: OSError: broken"]


def test_what_a_device_is_called_is_shown_harmless(monkeypatch: pytest.MonkeyPatch) -> None:
    probing(monkeypatch, row(found="\x1b[2Jadapter\n\u202e"))
    assert "\x1b" not in run()[1]
    assert run()[1].splitlines()[0] == "ok       thing  ␛[2Jadapter␊<U+202E>"


def test_a_package_that_is_too_old_is_named_with_what_is_needed() -> None:
    found = doctor._package_row("", ["pyserial>=99.1", "click>=8", "nonesuch"])
    assert (found.state, found.needed) == (CheckState.MISSING, True)
    assert re.match(r"pyserial [0-9.]+, 99\.1 is needed; no nonesuch; click ", found.found)
