"""A soak goes on where it was ended, and says which input did what."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from tests import soaking
from tests.soak_targets import TARGETS


def soak(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["soak", *words])
    monkeypatch.setattr("signal.signal", lambda number, handler: None)
    return soaking.main(__doc__)


@pytest.mark.parametrize("name", TARGETS)
def test_each_target_takes_inputs(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert soak(monkeypatch, name, "--inputs", "5") == 0
    assert capsys.readouterr().out.startswith(f"{name}: 5 inputs of seed 1, 0 findings;")


@pytest.fixture
def thrown(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return what is thrown at a target that dislikes the third input."""
    seen: list[float] = []

    def make() -> Callable[[Random], str]:
        def throw(chance: Random) -> str:
            seen.append(chance.random())
            if len(seen) == 3:
                raise ValueError("no")
            return "taken"

        return throw

    monkeypatch.setitem(TARGETS, "rrc", make)
    return seen


def test_it_goes_on_where_it_was_ended(
    tmp_path: Path,
    thrown: list[float],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    state = ("--state", str(tmp_path))
    assert soak(monkeypatch, "rrc", "--inputs", "2", *state) == 0
    assert soak(monkeypatch, "rrc", "--inputs", "6", *state) == 1
    assert "input 2: ValueError: no" in capsys.readouterr().out
    assert len(set(thrown)) == len(thrown) == 6
    kept = json.loads((tmp_path / "rrc.json").read_text("utf-8"))
    assert (kept["done"], kept["seen"], list(kept["found"])) == (6, {"taken": 5}, ["2"])


def test_one_input_is_thrown_again(thrown: list[float], monkeypatch: pytest.MonkeyPatch) -> None:
    soak(monkeypatch, "rrc", "--inputs", "2")
    second = thrown[1]
    thrown.clear()
    soak(monkeypatch, "rrc", "--one", "1")
    assert thrown == [second]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{}", "says not how far a soak is: KeyError"),
        ("[", "says not how far a soak is: JSONDecodeError"),
        ('{"seed": 2, "done": 1, "cpu_s": 0, "seen": {}, "found": {}}', "is of seed 2, not 1"),
    ],
)
def test_a_file_that_is_no_state_is_told(
    text: str, said: str, tmp_path: Path, thrown: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "rrc.json").write_text(text, "utf-8")
    with pytest.raises(SystemExit, match=said):
        soak(monkeypatch, "rrc", "--inputs", "2", "--state", str(tmp_path))
    assert thrown == []


def test_guided_says_what_it_wants(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "atheris", None)
    with pytest.raises(SystemExit) as ended:
        soak(monkeypatch, "rrc", "--guided")
    assert ended.value.code == "--guided wants Atheris: pip install 'tickrig[fuzz]'"
