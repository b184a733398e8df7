"""How commands start and end: each as a console script, in a process of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = pytest.mark.realtime

START = "from tickrig.host.cli.start import start; start('it', 'it:command')"
COMMAND = """
import click

@click.command()
def command():
    {body}
"""


@pytest.fixture
def started(tmp_path: Path) -> Callable[..., subprocess.Popen[str]]:
    def start(body: str, ignored: int = 0, **files: str) -> subprocess.Popen[str]:
        for name, text in {"it": COMMAND.format(body=body), **files}.items():
            (tmp_path / f"{name}.py").write_text(text, "utf-8")

        def ignore() -> None:
            if ignored:
                signal.signal(ignored, signal.SIG_IGN)

        return subprocess.Popen(
            [sys.executable, "-u", "-c", START],
            env={**os.environ, "PYTHONPATH": os.pathsep.join([*map(str, sys.path), str(tmp_path)])},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            preexec_fn=ignore,  # noqa: PLW1509 - no other thread runs here
        )

    return start


Started = Callable[..., subprocess.Popen[str]]
CLEANS_UP = (
    "try:\n        print('ready')\n        input()\n    finally:\n        print('cleaned up')"
)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_lets_a_command_clean_up(started: Started, number: int) -> None:
    with started(CLEANS_UP) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(number)
        assert process.stdout.read() == "cleaned up\n\n"
    assert process.returncode == 128 + number


def test_sigint_that_is_ignored_at_the_start_ends_it_too(started: Started) -> None:
    with started(CLEANS_UP, signal.SIGINT) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        assert process.stdout.read() == "cleaned up\n\n"
    assert process.returncode == 130


def test_sighup_that_is_ignored_at_the_start_stays_ignored(started: Started) -> None:
    with started(CLEANS_UP, signal.SIGHUP) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGHUP)
        assert process.communicate("\n")[0] == "cleaned up\n"
    assert process.returncode == 0


def test_an_import_that_hangs_is_interrupted(started: Started) -> None:
    with started("import hangs", hangs="print('hangs')\nwhile True:\n    pass\n") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "hangs\n"
        process.send_signal(signal.SIGINT)
        assert process.stdout.read() == "\n"
    assert process.returncode == 130


def test_an_import_is_finished_before_it_is_interrupted(started: Started) -> None:
    half = "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\nprint('imported')\n"
    body = (
        "try:\n        import half\n    finally:\n        import sys; print('half' in sys.modules)"
    )
    with started(body, half=half) as process:
        assert process.communicate()[0].splitlines()[:2] == ["imported", "True"]
    assert process.returncode == 130
