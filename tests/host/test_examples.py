from __future__ import annotations

import contextlib
import os
import runpy
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host.live import live_rrc, pty

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name: str, monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    monkeypatch.setattr("sys.argv", [name, *arguments])
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")


def test_every_example_has_at_most_40_lines() -> None:
    lengths = {path.name: len(path.read_text().splitlines()) for path in EXAMPLES.glob("*.py")}
    assert lengths
    assert max(lengths.values()) <= 40


def test_a_minute_in_virtual_time(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run("rrc_virtual_time.py", monkeypatch)
    assert capsys.readouterr().out.splitlines() == [
        "60.480 s: Output, 30 %",
        "60.780 s: EV:PowerOffWaitByWatchdog",
        "60.780 s: PowerOffByOthers, 0 %",
    ]


@pytest.mark.realtime
def test_what_an_rrc_says_on_a_port(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pty() as port, live_rrc(port) as rrc:
        rrc.set("power_button", 1)
        run("rrc_serial.py", monkeypatch, port.path)
    name, *rest = capsys.readouterr().out.splitlines()
    assert name == "RRC, Version 1.0, Apr 30 2015 00:00:00"
    assert rest[-1].startswith("StatusA(")


def test_a_port_that_is_not_there_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SystemExit, match="cannot open '/dev/no-such-port'"):
        run("rrc_serial.py", monkeypatch, "/dev/no-such-port")


@pytest.mark.parametrize("name", ["rrc_serial.py", "rrc_control_loop.py"])
def test_without_a_port_the_usage_is_shown(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SystemExit, match=f"usage: .*{name} URL"):
        run(name, monkeypatch)


@contextlib.contextmanager
def ended(process: subprocess.Popen[str]) -> Iterator[None]:
    """End a process with the test, however that ends."""
    try:
        yield
    finally:
        process.kill()


@pytest.mark.realtime
def test_the_control_loop_follows_the_stick_until_vr2_is_off() -> None:
    command = [sys.executable, str(EXAMPLES / "rrc_control_loop.py")]
    environment = {**os.environ, "PYTHONPATH": str(EXAMPLES.parent / "src")}
    with (
        pty() as port,
        live_rrc(port) as rrc,
        subprocess.Popen(
            [*command, port.path], env=environment, stdout=subprocess.PIPE, text=True
        ) as loop,
        ended(loop),
    ):
        assert loop.stdout is not None
        assert loop.stdout.readline() == "press the power button\n"
        rrc.set("power_button", 1)
        rrc.await_output("state", "Output")
        rrc.move_stick(60, -20)
        rrc.await_output("out_v_pct", 30)
        rrc.await_output("out_w_pct", -10)
        rrc.set("power_button", 0)
        rrc.set("power_button", 1)
        last_words, _ = loop.communicate(timeout=10)
    assert last_words.splitlines() == [
        "EV:PowerOffWaitByButton",
        "EV:PowerOffFinished",
        "EV:Initialized",
    ]
