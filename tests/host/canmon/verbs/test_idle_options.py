"""Each option of a verb does something, or is refused: none is ignored without a word."""

from __future__ import annotations

import shlex
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from tickrig.host.canmon.cli import main

EXAMPLES = Path(__file__).parents[4] / "examples"
EPOS = EXAMPLES / "eds" / "epos.eds"
FIRST_S = 1_700_000_000
LOG = [
    "can0 000#0100",
    "can0 085#1082110100000000",
    *[f"can0 705#{5 if n else 0:02X}" for n in range(8)],
    "can0 605#4018100100000000",
    "can0 585#4318100100000000",
    "can0 605#4018100200000000",
    "can0 585#4318100210620000",
    "can0 605#4018100300000000",
    "can0 585#4318100300000100",
    *[f"can0 185#3700{n:02X}000000" for n in range(8)],
    "can0 085#1082110100000000",
    "can0 20000088#0000010000000000",
    "can0 085#1082110100000000",
    "noise",
    "bench 123##1AABB T",
]
DBC = """\
VERSION ""
BO_ 389 Position: 6 Vector__XXX
 SG_ way : 0|16@1+ (1,0) [0|0] "" Vector__XXX
"""

GIVEN: dict[str, tuple[str, ...]] = {
    "stamp": ("-t", "A"),
    "extra": ("-x",),
    "errors": ("-e",),
    "raw": ("-r",),
    "wanted": ("-F", "node=5 and pdo"),
    "eds": ("--eds", f"5={EPOS}"),
    "eds_folders": ("--eds-dir", str(EPOS.parent)),
    "dbc": ("--dbc", "way.dbc"),
    "begin": ("--from", "0.017"),
    "end": ("--to", "0.020"),
    "reopen": ("--reopen",),
    "count": ("-n", "2"),
    "quiet_ms": ("-T", "100"),
    "strict": ("--strict",),
    "span_us": ("--for", "3ms"),
    "interface": ("-i", "virtual"),
    "channel": ("-c", "can7"),
    "timing": ("--timing", "tseg1=5"),
    "bus_kwargs": ("--bus-kwargs", "port=43113"),
    "fd": ("--fd",),
    "by": ("--by", "node"),
    "jsonl": ("--jsonl",),
    "decode": ("-d",),
    "rotate": ("--rotate", "1M"),
    "disk": ("--disk", "2M"),
    "at_limit": ("--at-limit", "end"),
    "trigger": ("--trigger", "emcy"),
    "pre": ("--pre", "1"),
    "post": ("--post", "1"),
    "title": ("--title", "Run"),
    "at": ("--at", "0.01"),
    "ranges": ("--range", "1=0..9"),
    "size": ("--size", "800x300"),
    "window_us": ("--window", "3s"),
    "files": ("-o", "x.svg"),
    "around": ("--around", "1"),
    "most": ("--max", "1"),
    "init": ("--init",),
    "output": ("-o", "x.toml"),
    "report_path": ("--junit", "x.xml"),
    "sarif_path": ("--sarif", "x.sarif"),
}
"""How each option is given that does not choose a form."""
OPENS = {"interface", "channel", "timing", "bus_kwargs", "fd", "reopen"}
RECORDS = {"rotate", "disk", "at_limit", "trigger", "pre", "post"}
DECODES = {"eds", "eds_folders", "dbc"}
PICTURES = {"title", "size", "ranges", "at"}

FORMS: dict[str, set[str]] = {
    "dump run.log": OPENS | RECORDS | {"quiet_ms"},
    "dump run.log -r": OPENS | RECORDS | {"quiet_ms"} | DECODES,
    "dump run.log -r -F 'node=5 or error'": OPENS | RECORDS | {"quiet_ms"},
    "dump run.log --jsonl": OPENS | RECORDS | {"quiet_ms", "stamp", "extra"},
    "dump run.log --csv": OPENS | RECORDS | {"quiet_ms", "stamp", "extra"},
    "dump run.log -L": OPENS | RECORDS | DECODES | {"quiet_ms", "stamp", "extra", "errors", "raw"},
    "dump run.log -l x.log": OPENS
    | {"at_limit"}
    | {"quiet_ms", "stamp", "extra", "errors", "raw", "output"},
    "conv run.log x.log": DECODES,
    "stats run.log": OPENS,
    "top run.log": OPENS | DECODES,
    "top run.log -d": OPENS,
    "top run.log -F node=5": OPENS,
    "nodes run.log": OPENS,
    "graph run.log": OPENS | PICTURES | {"begin", "end", "window_us", "files"},
    "graph run.log 185[2]": OPENS | DECODES | {"title", "size", "window_us"},
    "graph run.log 185[2] -o g.svg": OPENS | DECODES | {"window_us"},
    "graph run.log 185[2] -o g.csv": OPENS | DECODES | PICTURES | {"window_us"},
    "check run.log": OPENS | {"output", "dbc"},
    "check run.log --jsonl": OPENS | {"init"} | {"output", "dbc", "stamp", "most"},
    "check run.log --rule 'emcy never'": OPENS | {"init", "output"},
    "check run.log --no-emcy": OPENS | {"init", "around"} | {"init"} | {"output", "dbc"},
    "check run.log --init": OPENS
    | {"around", "most", "report_path", "sarif_path", "jsonl", "stamp", "dbc"},
    "report run.log -o g.html": OPENS | {"span_us"},
}
"""Calls of verbs, and which options each of them refuses; all others do something."""
ALREADY = {
    ("dump run.log", "errors"): "error frames are in words already",
    ("dump run.log -r", "raw"): "given",
    ("dump run.log -r -F 'node=5 or error'", "raw"): "given",
    ("dump run.log -r -F 'node=5 or error'", "eds"): "no object by name is asked for",
    ("dump run.log --jsonl", "errors"): "error frames are in words already",
    ("dump run.log --csv", "errors"): "likewise",
    ("dump run.log --jsonl", "output"): "given",
    ("check run.log --jsonl", "jsonl"): "given",
    ("top run.log -d", "decode"): "given",
    ("top run.log -F node=5", "eds"): "no object by name is asked for",
    ("check run.log", "eds"): "this file has no heartbeat time",
    ("check run.log --jsonl", "eds"): "likewise",
    ("check run.log --no-emcy", "eds"): "likewise",
    ("check run.log --no-emcy", "eds_folders"): "likewise",
    ("check run.log --init", "init"): "given",
}


def outcome(folder: Path, words: list[str]) -> tuple[int, str, str, dict[str, bytes]]:
    """Return all that a call did."""
    for file in folder.iterdir():
        if file.name.startswith(("x.", "g.")):
            file.unlink()
    result = CliRunner().invoke(main, words)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    files = {file.name: file.read_bytes() for file in folder.iterdir()}
    return result.exit_code, result.stdout, result.stderr, files


@pytest.mark.parametrize("form", FORMS)
def test_an_option_does_something_or_is_refused(
    form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    lines = [
        line if line == "noise" else f"({FIRST_S + at / 1e3:.6f}) {line}"
        for at, line in enumerate(LOG)
    ]
    Path("run.log").write_text("\n".join([*lines, ""]), "ascii")
    Path("way.dbc").write_text(DBC, "ascii")
    words = shlex.split(form)
    _, verb, _ = main.resolve_command(click.Context(main), words)
    assert verb is not None
    names = [one.name or "" for one in verb.params if isinstance(one, click.Option)]
    before, found = outcome(tmp_path, words), {}
    for name in names:
        if name not in GIVEN:
            continue
        code, _, said, _ = after = outcome(tmp_path, [*words, *given(words[0], name)])
        found[name] = "refused" if code == 2 else "idle" if after == before else "honoured"
        assert code != 2 or said.count("\n") == 1, said
    expected = {
        name: "refused"
        if name in FORMS[form]
        else "idle"
        if (form, name) in ALREADY
        else "honoured"
        for name in found
    }
    assert found == expected
    assert found


def given(verb: str, name: str) -> tuple[str, ...]:
    """Return an option with its value."""
    if (verb, name) == ("dump", "output"):
        return ("--jsonl",)
    return GIVEN[name]
