"""No command lets a text of a file, a bus or its own command line command the terminal."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import click
import pytest
from click.testing import CliRunner, Result

from tests.host.canmon.terminal import Terminal
from tickrig.host.cli.options import LazyCommand
from tickrig.host.cli.start import load

ROOT = Path(__file__).parents[1]
GOLDEN = ROOT / "tests" / "golden" / "canmon"
SCRIPTS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["scripts"]

SHORT: Final = "\x1b]52;c;QQ\x07\x9b2J\x08\x7f"
"""OSC 52, BEL, a CSI of one character, backspace, DEL: 14 characters without a blank."""
HOSTILE: Final = f"\x1b[31m{SHORT}\x1b]8;;http://x\x1b\\\u202e\u2028"
OBEYED: Final = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2066-\u2069]")
"""What a terminal obeys, but for newline and tab."""


def program(script: str) -> click.Command:
    """Return the command behind a console script."""
    function = SCRIPTS[script].partition(":")[2]
    source = (ROOT / "src" / "tickrig" / "commands.py").read_text("utf-8")
    found = re.search(rf'def {function}\(\).*?_start\("{script}", "(.*?)"\)', source, re.DOTALL)
    assert found
    return load(f"{found[1]}:main")  # type: ignore[no-any-return]  # a command


def leaves(command: click.Command, *above: str) -> Iterator[str]:
    """Give the words that lead to each command that has none below it."""
    if isinstance(command, LazyCommand):
        command = load(command.path)
    if isinstance(command, click.Group):
        for name in command.list_commands(context := click.Context(command)):
            found = command.get_command(context, name)
            assert found is not None
            yield from leaves(found, *above, name)
    else:
        yield " ".join(above)


LEAVES: Final = [line for script in SCRIPTS for line in leaves(program(script), script)]


def call(line: str, *more: str, typed: str | bytes | None = None) -> Result:
    """Call a command as a console script does."""
    script, *words = line.split()
    result = CliRunner().invoke(program(script), [*words, *more], input=typed, prog_name=script)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.mark.parametrize("line", LEAVES)
def test_a_hostile_command_line_is_told_in_pictures(line: str, tmp_path: Path) -> None:
    name = str(tmp_path / HOSTILE)
    for more in (
        [f"--no-{HOSTILE}"],
        [name],
        [name, name],
        [f"--eds=5={name}", f"--wait={name}", name],
    ):
        result = call(line, *more)
        assert not OBEYED.search(result.output), result.output


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with files in which each text is hostile; it is the current one."""
    eds = (ROOT / "examples" / "eds" / "epos.eds").read_text("utf-8")
    eds = eds.replace("DefaultValue=EPOS", "DefaultValue=EPOS\x1b[31m\x07")
    write(tmp_path / "node.eds", eds)
    eds = re.sub(r"(?m)^((?:Parameter|Product|Vendor)Name|CreatedBy)=(.*)$", rf"\1=\2{SAFE}", eds)
    write(tmp_path / "a.eds", eds.replace(SAFE, HOSTILE))
    write(tmp_path / "b.eds", eds.replace(SAFE, f"{HOSTILE}b").replace("=0x0004", f"={HOSTILE}"))
    xdd = "<a><CANopenObjectList><CANopenObject index='1000' name='&#x9b;2J&#x202e;&#10;FAIL'/>"
    write(tmp_path / "a.xdd", f"{xdd}</CANopenObjectList></a>")
    log = (GOLDEN / "drive.log").read_text("utf-8").replace("can0", SHORT)
    (tmp_path / "a.log").write_bytes(log.encode("latin-1"))
    (tmp_path / "noise.log").write_bytes(f"{HOSTILE}\n(1.0) {SHORT} 123#{SHORT}\n".encode() * 3)
    (tmp_path / "a.jsonl").write_text(
        json.dumps({"v": 1, "t": 1.0, "ch": SHORT, "id": 291, "x": 0, "dir": "rx", "data": "0102"})
    )
    dbc = (GOLDEN / "engine.dbc").read_text("utf-8")
    dbc = dbc.replace('"rpm"', f'"{SHORT}"').replace('"neutral"', f'"{SHORT}\nFAIL"')
    (tmp_path / "a.dbc").write_bytes(dbc.encode("cp1252", "replace"))
    write(tmp_path / "engine.log", "(1.000000) can0 123#0000000000000000\n")
    write(tmp_path / "rules.toml", f'rules = ["{RULE}: never 181"]\n'.replace(RULE, TOML))
    write(tmp_path / "wrong.toml", f'"{TOML}" = 1\n[device.a]\ntype = "{TOML}"\n')
    write(
        tmp_path / "rig.toml",
        '[wire.can]\ntype = "can"\n[device.node]\ntype = "node.eds"\nwire = "can"\nnode_id = 5\n',
    )
    write(tmp_path / "seq.toml", f'[[step]]\nsend = "{TOML}"\n')
    write(
        tmp_path / "bus.yml", f'master: {{node_id: 1}}\n"{TOML}": {{dcf: "{TOML}", node_id: 2}}\n'
    )
    write(tmp_path / "scenario.txt", f"1ms send {HOSTILE}\n")
    write(tmp_path / "system.toml", f'[[component]]\nname = "{TOML}"\ntype = "{TOML}"\n')
    write(tmp_path / "definition.yaml", f'bus: {{channel: "{TOML}"}}\n"{TOML}": 1\n')
    write(tmp_path / "table.csv", f"{HOSTILE},seed\n")
    write(tmp_path / "run.json", json.dumps({"version": HOSTILE}))
    write(tmp_path / "a.trace", f"# tickrig-trace v1 rrc {{}}\n{HOSTILE}\n")
    write(tmp_path / "path.txt", f"1 2 {HOSTILE}\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


SAFE: Final = "-hostile-"
RULE: Final = "RULE"
TOML: Final = "".join(f"\\u{ord(each):04x}" for each in HOSTILE)
"""As a string of TOML and YAML has it."""


def write(path: Path, text: str) -> None:
    path.write_text(text, "utf-8", newline="")


READ = """
canmon dump a.log
canmon dump a.log -x -ta
canmon dump noise.log
canmon dump a.jsonl
canmon dump a.log --jsonl
canmon dump engine.log --dbc a.dbc
canmon dump engine.log --dbc a.dbc --jsonl
canmon dump a.log --eds 5=a.eds
canmon dump a.log --eds 5=a.eds --jsonl
canmon dump a.log -F "
canmon info a.log
canmon info noise.log --jsonl
canmon top a.log
canmon top a.log -d --eds 5=a.eds
canmon top engine.log -d --dbc a.dbc
canmon stats a.log
canmon stats a.log --jsonl
canmon nodes a.log --eds 5=a.eds
canmon nodes a.log --eds 5=a.eds --jsonl
canmon check a.log rules.toml
canmon check a.log --no-emcy --jsonl
canmon check a.log --rules rules.toml
canmon graph engine.log Speed --dbc a.dbc
canmon graph a.log 5.6041h --eds 5=a.eds
canmon conv a.log out.csv
canmon conv a.log out.asc
canmon play a.log --dry-run
canmon eds check a.eds
canmon eds check b.eds --json
canmon eds show a.eds
canmon eds show a.eds --json
canmon eds show a.xdd
canmon eds diff a.eds b.eds
canmon eds diff a.eds b.eds --json
canmon eds fix b.eds --dry-run
canmon eds fix b.eds -o c.eds
canmon seq seq.toml --dry-run
canmon seq can0 seq.toml
canmon net rig.toml scan
canmon net rig.toml scan --json
canmon net rig.toml read 5 1008h
canmon net rig.toml read 5 1008h --json --eds a.eds
canmon net rig.toml read 5 --eds a.eds
canmon net rig.toml dcf 5 a.eds --dry-run
canmon net rig.toml compare 5 a.eds
canmon net rig.toml boot 5 --eds a.eds --yes
canmon net rig.toml write 5 1008h=1 --eds a.eds --yes
canmon conform rig.toml --node 5 --eds a.eds --read-only
canmon conform rig.toml --node 5 --eds a.eds --read-only --json -
tickrig check wrong.toml
tickrig check rig.toml
tickrig check bus.yml
tickrig check a.eds
tickrig check scenario.txt
tickrig run rig.toml --virtual --for 10ms
tickrig run wrong.toml
tickrig init --device a.eds
tickrig replay a.trace
tickrig replay scenario.txt
tickrig compare a.trace
tickrig report run.json
tickrig campaign merge table.csv
tickrig rtc run system.toml
tickrig rtc check system.toml
tickrig emu rrc --scenario scenario.txt
tickrig emu canopen-slave --eds a.eds --node-id 5 --scenario scenario.txt
canopen-slave-emu --eds a.eds --node-id 5 --write-eds -
canopen-slave-emu --rig wrong.toml --scenario scenario.txt
rtc-canopen-builder system.toml
rtc-canopen-server definition.yaml
rh3 path path.txt
ucode-resolver system.toml
"""
"""Commands that read these files."""

SHOWN = """
canmon dump a.log
canmon dump engine.log --dbc a.dbc
canmon top a.log
canmon stats a.log
canmon eds show a.eds
canmon eds diff a.eds b.eds
canmon net rig.toml scan
"""
"""Those in which the text is certainly seen."""


MACHINE = """
canmon dump a.log -L
canmon dump a.log --csv
canmon gateway rig.toml
"""
"""What programs read keeps its characters, but at a terminal."""


@pytest.mark.parametrize("line", MACHINE.strip().splitlines())
def test_what_programs_read_is_shown_in_pictures_at_a_terminal(folder: Path, line: str) -> None:
    typed = "[1] 5 r 0x1008 0 vs\n"
    assert OBEYED.search(call(line, typed=typed).stdout)
    write(folder / "typed", typed)
    terminal = Terminal(*line.split()[1:], feed=folder / "typed")
    terminal.end()
    assert not OBEYED.search(terminal.written.replace("\r\n", "\n")), terminal.written
    assert re.search("␛|␇", terminal.text())


@pytest.mark.realtime
@pytest.mark.parametrize("words", ["tui a.log --eds 5=a.eds", "top -"])
def test_the_screens_show_pictures_and_read_no_markup(folder: Path, words: str) -> None:
    markup = SHORT[:-4] + "[@click=app.quit]"
    log = (folder / "a.log").read_bytes().replace(SHORT.encode("latin-1"), markup.encode("latin-1"))
    (folder / "a.log").write_bytes(log)
    feed = folder / "a.log" if words == "top -" else None
    terminal = Terminal(*words.split(), columns=160, feed=feed)
    if feed is None:
        for key, said in {"2": "MAKER", "4": "OBJECT", "3": "identifiers by id"}.items():
            terminal.wait_for("LISTEN-ONLY")
            terminal.child.send(key)
            terminal.wait_for(said)
    terminal.wait_for("␛]52;c;QQ␇�[@click=app.quit]: 134 frames")
    terminal.child.send("q")
    assert terminal.end() == 0
    for obeyed in ("\x1b]52", "\x1b[31m", "\x9b", "\x08", "\u202e", "\u2028"):
        assert obeyed not in terminal.written


@pytest.mark.parametrize("line", READ.strip().splitlines())
def test_what_files_say_is_shown_in_pictures(folder: Path, line: str) -> None:
    result = call(line, typed=f"[1] {HOSTILE}\n[1] 5 r 0x1008 0 vs\n")
    assert not OBEYED.search(result.output), result.output
    assert "Traceback" not in result.output
    if line in SHOWN.strip().splitlines():
        assert re.search("␛|<U+202E>", result.output), result.output
