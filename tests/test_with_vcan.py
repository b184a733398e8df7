"""What tools/with-vcan says before it runs anything; that it runs, the CI shows."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[1] / "tools" / "with-vcan"


def run(*words: str) -> tuple[int, str, str]:
    done = subprocess.run([str(TOOL), *words], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def test_its_help_has_examples() -> None:
    status, out, _ = run("--help")
    assert status == 0
    assert "  with-vcan pytest tests/interop\n" in out


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ([], "no command; see with-vcan --help"),
        (["--fast", "true"], "no option --fast; see with-vcan --help"),
        (["--timeout"], "--timeout needs a value"),
        (["--timeout", "1m", "true"], "--timeout 1m: whole seconds are wanted, as 60"),
        (["--memory", "lots", "true"], "--memory lots: a size is wanted, as 512M or 1G"),
        (["--bus", "9", "true"], "--bus 9: a name is wanted, as vcan0"),
    ],
)
def test_a_mistake_is_one_line_and_status_125(words: list[str], error: str) -> None:
    assert run(*words) == (125, "", f"with-vcan: {error}\n")
