from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tickrig.host.cli.extensions import ExtensionError, ExtensionGroup

GROUP = ExtensionGroup[str](
    "tickrig.colours",
    "colour",
    {"red": "tests.host.cli.test_extensions:RED"},
    lambda found: isinstance(found, str),
    "a string",
)
RED = "#f00"
MODULES = {
    "good_colours": "GREEN = '#0f0'\nNUMBER = 3\n",
    "bad_colours": "raise RuntimeError('out of\\npaint')\n",
    "rude_colours": "raise SystemExit(5)\n",
}
POINTS = """\
[tickrig.colours]
green = good_colours:GREEN
red = good_colours:NUMBER
number = good_colours:NUMBER
missing = good_colours:BLUE
bad = bad_colours:GREEN
rude = rude_colours:GREEN
nowhere = no_such_colours:GREEN
"""


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put a foreign package on the path, twice."""
    for folder in ("first", "second"):
        info = tmp_path / folder / "paint-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: paint\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(POINTS)
        for name, text in MODULES.items():
            (tmp_path / folder / f"{name}.py").write_text(text)
        monkeypatch.syspath_prepend(str(tmp_path / folder))
    for name in MODULES:
        monkeypatch.delitem(sys.modules, name, raising=False)


def test_ours_come_first_and_all_are_named() -> None:
    names = ["red", "bad", "green", "missing", "nowhere", "number", "rude"]
    assert GROUP.names() == names


def test_a_member_is_loaded_by_name() -> None:
    assert (GROUP.load("red"), GROUP.load("green")) == ("#f00", "#0f0")


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("blue", "no colour 'blue'; known: red, bad, green, missing, nowhere, number, rude"),
        (
            "bad",
            "colour 'bad' of package paint (bad_colours:GREEN): RuntimeError: out of paint",
        ),
        ("rude", "colour 'rude' of package paint (rude_colours:GREEN): SystemExit: 5"),
        ("number", "colour 'number' of package paint (good_colours:NUMBER) is not a string"),
    ],
)
def test_what_cannot_be_loaded_is_one_line(name: str, line: str) -> None:
    with pytest.raises(ExtensionError) as caught:
        GROUP.load(name)
    assert str(caught.value) == line


def test_what_is_broken_does_not_break_the_others() -> None:
    told = list[str]()
    assert GROUP.load_all(told.append) == {"red": "#f00", "green": "#0f0"}
    assert [line.split("'")[1] for line in sorted(told)] == [
        *("bad", "missing", "nowhere", "number", "rude"),
    ]
    assert not any("\n" in line for line in told)
