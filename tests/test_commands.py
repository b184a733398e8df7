"""Every console command: without extras, interrupted while it loads, unable to print."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import packages_distributions, requires
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner
from packaging.requirements import Requirement

from tickrig import __version__
from tickrig.emulators.commands.cli import DEMOS
from tickrig.emulators.commands.cli import main as tickrig
from tickrig.emulators.rh3.commands.motion_cli import main as rh3
from tickrig.host.canmon.cli import main as canmon
from tickrig.host.cli.options import LazyCommand
from tickrig.host.cli.start import load
from tickrig.host.rrc.cli import main as rrc

ROOT = Path(__file__).parents[1]
SCRIPTS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["scripts"]
LOG = "(1.000000) can0 185#0102\n"

BAD = {
    "tickrig": ("ctl /nowhere describe", "/nowhere: No such file"),
    "rrc-emu": ("--panel", "pip install 'tickrig[tui]'"),
    "rrc": ("/nowhere --panel", "pip install 'tickrig[tui]'"),
    "rtc-lite-emu": ("--node nowhere.py:Echo", "nowhere.py: No such file"),
    "canmon": ("tui a.log", "pip install 'tickrig[tui]'"),
    "rh3": ("goto 1 0 0 --plot a.png", "pip install 'tickrig[plot]'"),
    "rh3-emu": ("--address 0", "0"),
    "ucode-reader-emu": ("--marker 1", "a marker is UCODE,X,Y in m, got '1'"),
    "ucode-resolver": ("/nowhere", "table /nowhere: No such file"),
    "tkernel-emu": ("--connectors 0", "connectors 0 is not in 1..1000"),
    "urg-emu": ("--room 4", "a room is WIDTH,DEPTH"),
    "canopen-slave-emu": ("--eds nowhere.eds --node-id 5 --scenario -", "nowhere.eds"),
    "rtc-canopen-server": ("a.yaml", "pip install 'tickrig[rtc]'"),
    "rtc-canopen-builder": ("a.toml", "pip install 'tickrig[rtc]'"),
    "rtc-canopen-editor": ("a.yaml", "pip install 'tickrig[tui]'"),
}
"""A bad input for each, of those that want an extra where there is one, and what is said."""

GOOD = {
    "canmon dump a.log": "185   [2]  01 02",
    "canmon conv a.log b.csv": "",
    "canmon stats a.log": "185",
    "canmon top a.log": "185",
    "canmon check a.log --no-emcy": "",
    "canmon nodes a.log": "",
    "rtc-canopen-builder --example": "[[port]]",
    "canopen-slave-emu --model rtc-echo --write-eds -": "[DeviceInfo]",
}
"""What works without extras, and a part of what it says."""


def plain_distributions() -> set[str]:
    """Name what `pip install tickrig` brings along."""
    found, todo = set(), ["tickrig"]
    while todo:
        name = todo.pop().lower().replace("_", "-")
        if name not in found:
            found.add(name)
            for each in map(Requirement, requires(name) or ()):
                if each.marker is None or each.marker.evaluate({"extra": ""}):
                    todo.append(each.name)
    return found


def missing_packages() -> list[str]:
    plain = plain_distributions()
    return [
        package
        for package, owners in packages_distributions().items()
        if plain.isdisjoint(owner.lower().replace("_", "-") for owner in owners)
    ]


def paths(command: click.Command, *above: str) -> Iterator[tuple[str, ...]]:
    """Give the words that lead to each command."""
    yield above
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from paths(found, *above, name)


GROUPS = {"tickrig": tickrig, "rh3": rh3, "canmon": canmon, "rrc": rrc}
HELP = [
    *(f"{script} --help" for script in SCRIPTS if script not in GROUPS),
    *(" ".join([*path, "--help"]) for name, group in GROUPS.items() for path in paths(group, name)),
]
LINES = [
    *(f"{script} --version" for script in SCRIPTS),
    *(f"{script} {words}" for script, (words, _) in BAD.items()),
    *GOOD,
    *HELP,
]
Result = tuple[int, str, str]
"""Exit status, standard output, standard error."""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Result]:
    """Return what each command line said where no extra is installed."""
    folder = tmp_path_factory.mktemp("plain")
    (folder / "a.log").write_text(LOG)
    process = subprocess.run(
        [sys.executable, ROOT / "tests" / "plain_install.py", ",".join(missing_packages())],
        input="".join(f"{SCRIPTS[line.split()[0]]} {line}\n" for line in LINES),
        capture_output=True,
        text=True,
        cwd=folder,
        check=True,
    )
    answers = map(json.loads, process.stdout.splitlines())
    return {line: tuple(answer) for line, answer in zip(LINES, answers, strict=True)}


def test_the_extras_are_what_a_plain_install_lacks() -> None:
    extras = {"textual", "tomlkit", "matplotlib", "numpy", "cantools", "yaml", "evdev"}
    assert extras <= {*missing_packages()}
    assert {"click", "can", "canopen", "serial"}.isdisjoint(missing_packages())


@pytest.mark.parametrize("line", HELP)
def test_help_needs_no_extra(said: dict[str, Result], line: str) -> None:
    code, out, err = said[line]
    assert (code, out[:6], err) == (0, "Usage:", "")


@pytest.mark.parametrize("script", SCRIPTS)
def test_the_version_has_one_form(said: dict[str, Result], script: str) -> None:
    assert said[f"{script} --version"] == (0, f"{script} (tickrig) {__version__}\n", "")


@pytest.mark.parametrize("script", SCRIPTS)
def test_bad_input_is_one_line(said: dict[str, Result], script: str) -> None:
    words, what = BAD[script]
    code, out, err = said[f"{script} {words}"]
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("Error: ")
    assert what in err


@pytest.mark.parametrize("line", GOOD)
def test_what_needs_no_extra_works(said: dict[str, Result], line: str) -> None:
    code, out, err = said[line]
    assert (code, "Traceback" in err) == (0, False)
    assert GOOD[line] in out


FIRST = 4
"""Python looks for two modules before it runs code of ours; the third is that code."""

LOADED = [
    *("canmon dump a.log", "canmon check a.log --no-emcy", "rtc-canopen-builder --example"),
    *("tickrig ctl /nowhere describe", "ucode-resolver /nowhere", "tkernel-emu --connectors 0"),
]
LOADING = [
    f"{count}{moment} {SCRIPTS[line.split()[0]]} {line}"
    for count in (FIRST, 8, 14, 25, 60, 100, 118, 122)
    for moment in ("", "cb")
    for line in LOADED
]


def test_ctrl_c_while_it_loads_ends_a_command_without_a_traceback(tmp_path: Path) -> None:
    (tmp_path / "a.log").write_text(LOG)
    process = subprocess.run(
        [sys.executable, ROOT / "tests" / "interrupted.py"],
        input="".join(f"{line}\n" for line in LOADING),
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=True,
    )
    answers = [json.loads(line) for line in process.stdout.splitlines()]
    pressed = [each for each in zip(LOADING, answers, strict=True) if each[1][0]]
    wrong = [
        (line, code, text)
        for line, (_, code, text) in pressed
        if code not in {-signal.SIGINT, 130} or "Traceback" in text or "ignored" in text
    ]
    assert wrong == []
    assert {code for _, (_, code, _) in pressed} == {-signal.SIGINT, 130}
    assert len(pressed) > len(LOADING) / 2


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("words", ["--help", "--version"])
def test_a_full_disk_is_one_line(words: str) -> None:
    with Path("/dev/full").open("w", encoding="ascii") as full:
        process = subprocess.run(
            [sys.executable, "-m", "tickrig", words],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert process.stderr == "Error: standard output: No space left on device\n"
    assert process.returncode == 3


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("words", ["tickrig check rig.toml", "tickrig check bus.yml"])
def test_a_full_disk_is_not_blamed_on_the_file_that_is_read(words: str, tmp_path: Path) -> None:
    assert run_onto_full_disk(words, tmp_path, "stdout") == (
        3,
        "Error: standard output: No space left on device\n",
    )


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("canmon check a.log --no-emcy", 0),
        ("canmon check emcy.log --no-emcy", 1),
        ("canmon eds check good.eds", 0),
        ("canmon check a.log --max 0", 2),
        ("canmon dump nowhere.log", 3),
        ("tickrig check --fast rig.toml", 2),
        ("tickrig run rig.toml --virtual --for 1ms", 0),
    ],
)
def test_standard_error_on_a_full_disk_leaves_the_status_as_it_is(
    words: str, status: int, tmp_path: Path
) -> None:
    assert run_onto_full_disk(words, tmp_path, "stderr")[0] == status


def run_onto_full_disk(words: str, folder: Path, stream: str) -> tuple[int, str]:
    """Run a command one of whose streams lies on a full disk; return its status and errors."""
    (folder / "a.log").write_text(LOG)
    (folder / "emcy.log").write_text("(1.000000) can0 085#0010010000000000\n")
    shutil.copy(ROOT / "examples" / "eds" / "epos.eds", folder / "good.eds")
    (folder / "bus.yml").write_text("master: {node_id: 1}\nx: {dcf: good.eds, node_id: 5}\n")
    (folder / "rig.toml").write_text(
        '[wire.can]\ntype = "can"\n[device.node]\ntype = "f-palette"\nwire = "can"\nnode_id = 5\n'
    )
    script, *more = words.split()
    function = SCRIPTS[script].partition(":")[2]
    with Path("/dev/full").open("w", encoding="ascii") as full:
        process = subprocess.run(
            [sys.executable, "-c", f"from tickrig.commands import {function}; {function}()", *more],
            stdout=full if stream == "stdout" else subprocess.PIPE,
            stderr=full if stream == "stderr" else subprocess.PIPE,
            text=True,
            check=False,
            cwd=folder,
        )
    return process.returncode, process.stderr or ""


# All commands of all console scripts: the names of their options and the examples of their help.

MODULES = dict(
    re.findall(r'_start\("(.+?)", "(.+?)"\)', (ROOT / "src/tickrig/commands.py").read_text("utf-8"))
)


def commands_below(command: click.Command, *words: str) -> Iterator[tuple[str, click.Command]]:
    """Yield each command with the words that lead to it."""
    if isinstance(command, LazyCommand):
        command = load(command.path)
    yield " ".join(words), command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from commands_below(found, *words, name)


COMMANDS = {
    words: command
    for script, module in MODULES.items()
    for words, command in commands_below(load(f"{module}:main"), script)
}


def examples(command: click.Command) -> list[str]:
    """Return the command lines in the help, without what a comment or a pipe adds."""
    blocks = re.findall(r"(?s)\x08\n(.*?)(?:\n\n|\Z)", command.help or "")
    lines = "\n".join(blocks).replace("\\\n", " ").splitlines()
    started = [line.strip() for line in lines if line.split()[:1] and line.split()[0] in SCRIPTS]
    return [re.split(r" {2,}(?![ -])| [|<>]", line)[0] for line in started]


def test_every_console_script_is_walked() -> None:
    assert MODULES.keys() == SCRIPTS.keys()
    assert {"tickrig rtc conf set", "tickrig ctl press", "canmon net scan"} <= COMMANDS.keys()


@pytest.mark.parametrize("words", COMMANDS)
def test_the_help_of_every_command_has_an_example(words: str) -> None:
    assert examples(COMMANDS[words])


EXAMPLES = {line for command in COMMANDS.values() for line in examples(command)}
OF_NEW = "tickrig emu lamp --link /tmp/lamp"
"""This device exists after the lines before it, in the help of `tickrig new device`."""


@pytest.mark.parametrize("line", sorted(EXAMPLES - {OF_NEW}))
def test_every_example_is_a_line_that_its_command_takes(line: str) -> None:
    script, *rest = shlex.split(line)
    command, context = COMMANDS[script], None
    while True:
        context = command.make_context(script, rest, parent=context)
        rest = [*context._protected_args, *context.args]
        if not isinstance(command, click.Group) or not rest:
            return
        _, found, rest = command.resolve_command(context, rest)
        assert found is not None
        command = found


OPTION_NAMES = {
    "--json": r"flag: (?!.*(one (a|per) line|object (a|per))).*JSON",
    "--jsonl": r"flag: .*(JSON, one a line|JSON object a)|flag: .*JSON.*\b(each|per)\b",
    "-o": r"(?i)(path|\S*file\S*|dir|out): (.*\b(write|record)\b|the (page|rules|trace)\b|"
    r"of --plot|output|file for|into a log|junit|svg|markdown|one page|\.svg)",
    "--plot": r".*: Draw|.*: .*\bas picture",
    "--control": r"(?i)path: .*(control socket|unix socket)",
    "--max": r"integer.*: .*\bshown\b",
    "--for": r".*: (How long|End after)\b",
}
"""The name of an option, and how `KIND: HELP` of all that do this begins."""

SECOND = "a second file beside the output, named by its kind"
CANDUMP = "the letter of candump"
OTHER_NAMES = {
    **dict.fromkeys(("--junit", "--sarif", "--html", "--badge", "--issue", "--report"), SECOND),
    **dict.fromkeys(("--write-baseline", "--save", "--trace", "--log", "--store"), SECOND),
    "-l": CANDUMP,
    "-n": CANDUMP,
    "-T": CANDUMP,
    "--pdf": "the page of -o once more",
    "--png": "the page of -o once more",
    "--write-eds": "it ends an emulator that writes nothing else",
    "--dot": "text for another program; no picture",
    "--map": "draws on the terminal",
    "--at": "the socket of a program that runs already",
    "--board": "tkernel-emu has two sockets; --control is that of its system",
    "--socket": "carries CiA 309-3, not the control protocol",
    "--wait": "ends as soon as the answer is there",
    "rrc test --json": "has a file since it was there; `--json -` prints",
    "canmon net scan --json": "a stream; the name is in scripts",
    **dict.fromkeys(
        [f"canmon net scan --{kind}" for kind in ("write", "workspace", "rules")], SECOND
    ),
    "canmon net read --json": "a stream; the name is in scripts",
    "canmon net program --control": "the object 1F51h, program control",
}
"""Options of another name for the same, or of a name for something else, with the reason."""


def misnamed(words: str, option: click.Option) -> Iterator[str]:
    """Yield what is wrong with the names of an option."""
    kind = "flag" if option.is_flag else option.metavar or option.type.name
    told = f"{kind}: {option.help}"
    for name, pattern in OPTION_NAMES.items():
        if bool(re.match(pattern, told)) != (name in option.opts) and not (
            name == "--json" and "--jsonl" in option.opts  # the old name of a stream
        ):
            yield f"{words} {option.opts[-1]}"


MISNAMED = {
    wrong
    for words, command in COMMANDS.items()
    for option in command.params
    if isinstance(option, click.Option)
    for wrong in misnamed(words, option)
}


def test_options_that_do_the_same_have_the_same_name() -> None:
    assert [one for one in MISNAMED if not {one, one.split()[-1]} & OTHER_NAMES.keys()] == []


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("--json", {"is_flag": True, "help": "Findings as JSON, one a line."}),
        ("--jsonl", {"is_flag": True, "help": "Print the answer as JSON."}),
        ("--file", {"metavar": "FILE", "help": "Write the table."}),
        ("--curve", {"type": click.Path(), "help": "Draw the curves."}),
        ("--serve", {"type": click.Path(), "help": "Control socket."}),
        ("--most", {"type": click.IntRange(1), "help": "Findings that are shown."}),
        ("--during", {"metavar": "TIME", "help": "End after this time."}),
    ],
)
def test_an_option_of_another_name_is_found(name: str, settings: dict[str, Any]) -> None:
    assert {*misnamed("canmon x", click.Option([name], **settings))} == {f"canmon x {name}"}


def test_no_exception_of_the_names_is_left_over() -> None:
    assert OTHER_NAMES.keys() - MISNAMED - {one.split()[-1] for one in MISNAMED} == set()


def test_the_table_of_option_names_is_what_is_held() -> None:
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    table = page.partition("| option | meaning |")[2].partition("\n\n")[0]
    assert re.findall(r"(?m)^\| `(-+\w+)", table) == [*OPTION_NAMES]


# The exit statuses of CONTRIBUTING.md: each command of all scripts ends with them.

BEFORE_VERB = {"tickrig ctl": "/nowhere", "rrc": "/nowhere", "canmon net": "slcan:/nowhere"}
"""What a group wants before its verbs."""

GONE, GONE_OPTIONS = "slcan:/nowhere", "-i slcan -c /nowhere"
SLAVE = f"--model epos --node-id 5 {GONE_OPTIONS}"
FIG120 = ROOT / "examples" / "rtc_canopen" / "fig120.yaml"
NO_BUS = {
    **{
        f"canmon {verb}": GONE
        for verb in ("dump", "top", "stats", "check", "nodes", "gateway", "tui")
    },
    "canmon report": f"{GONE} -o x.html",
    "canmon graph": f"{GONE} 185[0:2]",
    "canmon conform": f"{GONE} --node 5",
    "canmon send": f"{GONE} 185#01",
    "canmon seq": f"{GONE} ok.seq",
    "canmon play": f"a.log {GONE}",
    **{f"canmon net {verb}": "" for verb in ("scan", "lss")},
    **{f"canmon net {verb}": "5 --yes" for verb in ("store", "restore", "boot")},
    "canmon net nmt": "start 5 --yes",
    "canmon net read": "5 1000h",
    "canmon net write": "5 2222h=u8:1 --yes",
    "canmon net dcf": "5 good.eds --yes",
    "canmon net compare": "5 6",
    "canmon net program": "5 ok.seq --yes",
    **{f"rrc {verb}": "" for verb in ("status", "poweroff", "watch", "test")},
    "rrc beep": "1s",
    "rrc drive": "1 1 --for 1s",
    "rrc limit": "1 1",
    "rrc speed": "1",
    "rrc stick": "--reverse 3",
    "rh3 goto": "1 0 0 --device /nowhere",
    "rh3 path": "points.txt --device /nowhere",
    "rh3 square": "--device /nowhere",
    "rh3 serve": "--device /nowhere",
    "canopen-slave-emu": SLAVE,
    "tickrig emu canopen-slave": SLAVE,
    "tickrig demo fig120": GONE_OPTIONS,
    "tickrig record": "/nowhere -o x.trace",
    "rtc-canopen-server": f"{FIG120} {GONE_OPTIONS}",
}
"""By command, words that name a bus or a port that cannot be opened."""

ON_A_TERMINAL = {"rtc-canopen-editor"}
"""Opens its bus on a terminal alone; tests of its own."""

STRICT_LOG = {f"canmon {verb}": "dirty.log --strict" for verb in ("dump", "top", "stats", "nodes")}
STRICT_LOG |= {
    "canmon conv": "dirty.log x.log --strict",
    "canmon check": "dirty.log --nodes 5 --strict",
    "canmon report": "dirty.log -o x.html --strict",
    "canmon graph": "dirty.log 185[0:2] --strict",
}
STRICT_WARNINGS = {"tickrig check", "canmon eds check", "canmon tui"}
"""Here `--strict` is about warnings; the screen shows what was lost."""

ENDS = [
    (0, "canmon check a.log --nodes 5"),
    (0, "tickrig check rig.toml"),
    (0, "canmon eds check good.eds"),
    (1, "canmon check a.log --nodes 6"),
    (1, "canmon check a.log --no-emcy"),
    (1, "canmon dump a.log -F nmt"),
    (1, "canmon eds diff good.eds other.eds"),
    (1, "canmon net rig.toml read 5 2222h"),
    (1, "rrc-emu --scenario missed.txt"),
    (2, "canmon check a.log nowhere.toml"),
    (2, "canmon dump a.log --eds 5=nowhere.eds"),
    (2, "canmon eds check nowhere.eds"),
    (2, "canmon seq virtual:x nowhere.seq"),
    (2, "tickrig check nowhere.toml"),
    (2, "tickrig run nowhere.toml"),
    (2, "tickrig replay nowhere.trace"),
    (2, "tickrig rtc run nowhere.toml"),
    (2, "rrc-emu --scenario nowhere.txt"),
    (2, "rtc-canopen-server nowhere.yaml"),
    (2, "rtc-canopen-builder nowhere.toml"),
    (2, "ucode-resolver nowhere"),
    (2, "tkernel-emu nowhere.toml"),
    *(
        (3, f"canmon {verb} {log} {more}")
        for verb, more in (
            *(("dump", ""), ("top", ""), ("stats", ""), ("check", ""), ("nodes", "")),
            *(("info", ""), ("conv", "x.log"), ("report", "-o x.html"), ("graph", "185[0:2]")),
            ("play", "virtual:x"),
        )
        for log in ("nowhere.log", "bad.blf")
    ),
    (5, "canmon check empty.log"),
    (5, "canmon check empty.log --no-emcy"),
]
"""Exit status, and a line that ends with it."""


def ended(line: str) -> tuple[int, str]:
    """Run a line here; return its exit status and what it prints on standard error."""
    script, *words = shlex.split(line)
    result = CliRunner().invoke(load(f"{MODULES[script]}:main"), words)
    assert result.exception is None or isinstance(result.exception, SystemExit), line
    return result.exit_code, result.stderr


def with_words(command: str, words: str) -> str:
    """Put what a group wants before its verb."""
    for group, first in BEFORE_VERB.items():
        if command.startswith(f"{group} "):
            return f"{group} {first} {command.removeprefix(group)} {words}"
    return f"{command} {words}"


def leaves(*options: str, below: str = "") -> set[str]:
    """Return the commands that are no groups, below some words; with one of the options, if any."""
    return {
        words
        for words, command in COMMANDS.items()
        if not isinstance(command, click.Group)
        and words.startswith(below)
        and (not options or any({*options} & {*one.opts} for one in command.params))
    }


@pytest.fixture
def some_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stand in a folder with the files of the lines."""
    monkeypatch.chdir(tmp_path)
    eds = (ROOT / "examples" / "eds" / "epos.eds").read_text("utf-8")
    rig = '[device.node]\ntype = "f-palette"\nnode_id = 5\n'
    texts = {
        "a.log": f"{LOG}(1.100000) can0 705#05\n(1.200000) can0 085#1081110000000000\n",
        "dirty.log": f"{LOG}(1.100000) can0 705#05\nno frame\n{LOG}",
        "empty.log": "",
        "bad.blf": "no blf",
        "ok.seq": "+10 123#DE\n",
        "points.txt": "0 0\n1 0\n",
        "good.eds": eds,
        "other.eds": eds.replace("ProductName=EPOS", "ProductName=EPOS2"),
        "rig.toml": rig,
        "missed.txt": "1ms send version\\r\n1ms expect nothing-of-the-kind within 2ms\n",
    }
    for name, text in texts.items():
        Path(name).write_text(text, "utf-8")


@pytest.mark.parametrize("words", sorted(leaves()))
def test_wrong_use_of_every_command_is_2(words: str) -> None:
    status, said = ended(with_words(words, "--no-such-option"))
    assert (status, said.splitlines()[-1][:7]) == (2, "Error: "), said


def test_every_command_that_opens_a_bus_is_tried_without_one() -> None:
    opening = leaves("--interface", "--device") | leaves(below="canmon net ") | leaves(below="rrc ")
    assert opening - NO_BUS.keys() - {"tickrig init"} == ON_A_TERMINAL
    assert NO_BUS.keys() <= COMMANDS.keys()


@pytest.mark.usefixtures("some_files")
@pytest.mark.parametrize("words", NO_BUS)
def test_a_bus_that_cannot_be_opened_is_3(words: str) -> None:
    status, said = ended(with_words(words, NO_BUS[words]))
    assert (status, "/nowhere" in said) == (3, True), said


def test_every_strict_command_is_tried() -> None:
    assert leaves("--strict") == STRICT_LOG.keys() | STRICT_WARNINGS


@pytest.mark.usefixtures("some_files")
@pytest.mark.parametrize("words", STRICT_LOG)
def test_a_line_that_is_no_frame_is_4_with_strict(words: str) -> None:
    status, said = ended(f"{words} {STRICT_LOG[words]}")
    assert status == 4, said
    status, said = ended(f"{words} {STRICT_LOG[words].removesuffix('--strict')}")
    assert status == 0, said


@pytest.mark.usefixtures("some_files")
@pytest.mark.parametrize(("status", "line"), ENDS)
def test_a_command_ends_with_the_status_of_the_table(status: int, line: str) -> None:
    found, said = ended(line)
    assert found == status, said


@pytest.mark.usefixtures("some_files")
def test_ctrl_c_in_the_middle_is_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def press(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tickrig.host.canopen.commissioning.node_bus.NetworkScan.run", press)
    assert ended("canmon net rig.toml scan")[0] == 130


def test_the_table_of_exit_statuses_is_what_is_held() -> None:
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    table = page.partition("| exit status | meaning |")[2].partition("\n\n")[0]
    statuses = {*map(int, re.findall(r"(?m)^\| ([0-9]+) \|", table))}
    assert statuses == {status for status, _ in ENDS} | {4, 130}


# A misspelt name is guessed, of whatever it is the name.

MISSPELT = {
    "command": ("canmon dmp a.log", "Did you mean 'dump'?"),
    "verb": ("canmon net rig.toml scn", "Did you mean 'scan'?"),
    "demo": ("tickrig demo fig12", "Did you mean 'fig120'?"),
    "option": ("tickrig rtc ls --att x", "Did you mean '--at'?"),
    "word of an option": ("canmon eds fix good.eds --encoding asci", "Did you mean 'ascii'?"),
    "NMT command": ("canmon net rig.toml nmt strt 5", "Did you mean 'start'?"),
    "model": ("canopen-slave-emu --model epso --node-id 5", "Did you mean 'epos'?"),
    "device": ("tickrig emu rcc", "did you mean 'rrc'?"),
    "type of a recorded device": ("tickrig record /x -o y --type rcc", "did you mean 'rrc'?"),
    "interface of a bus": ("canmon dump -i virtul", "did you mean 'virtual'?"),
    "bus of a SOURCE": ("canmon dump slcn:x", "did you mean 'slcan'?"),
    "object": ("canmon net rig.toml read 5 device_typ", "did you mean 'device_type'?"),
    "rule as an option": ("canmon check a.log --no-emyc", "'--no-emcy'"),
    "rule by name": ("canmon check a.log --rule no-emyc", "did you mean --no-emcy?"),
    "key of rules": ("canmon check a.log rules.toml", "did you mean 'no_emcy'?"),
    "key of learnt rules": ("canmon check a.log learnt.toml", "did you mean 'others'?"),
    "word of a filter": ("canmon dump a.log -F nod=5", "did you mean 'node'?"),
    "kind in a filter": ("canmon dump a.log -F hartbeat", "did you mean 'heartbeat'?"),
    "type in a rig file": ("tickrig run type.toml", "did you mean 'epos'?"),
    "key of a rig file": ("tickrig run key.toml", "did you mean 'node_id'?"),
    "table of a rig file": ("tickrig run table.toml", "did you mean 'device'?"),
    "fault": ("tickrig run rig.toml --for 1ms --fault node/corupt", "did you mean 'node/corrupt'?"),
}
"""A line for each kind of name that a user can misspell, and what the message ends with."""

MISSPELT_FILES = {
    "rules.toml": "no_emyc = true\n",
    "learnt.toml": "[learnt.can0]\nothrs = true\n",
    "type.toml": '[device.drive]\ntype = "epso"\nnode_id = 5\n',
    "key.toml": '[device.drive]\ntype = "epos"\nnode_idd = 5\n',
    "table.toml": '[devices.drive]\ntype = "epos"\nnode_id = 5\n',
}


@pytest.mark.usefixtures("some_files")
@pytest.mark.parametrize("kind", MISSPELT)
def test_a_misspelt_name_is_guessed(kind: str) -> None:
    for name, text in MISSPELT_FILES.items():
        Path(name).write_text(text, "utf-8")
    line, meant = MISSPELT[kind]
    status, said = ended(line)
    assert status in (1, 2)
    assert meant in said


def test_the_package_is_the_command() -> None:
    words = [sys.executable, "-m", "tickrig", "--version"]
    assert subprocess.check_output(words, text=True) == f"tickrig (tickrig) {__version__}\n"


def test_demo_without_a_name_lists_what_can_be_typed() -> None:
    listed = CliRunner().invoke(tickrig, ["demo"])
    assert listed.exit_code == 0
    typed = [line.partition("  ")[0] for line in listed.output.splitlines()]
    assert typed == [f"tickrig demo {name}" for name in DEMOS]
    for words in typed:
        assert CliRunner().invoke(tickrig, [*words.split()[1:], "--help"]).exit_code == 0


@pytest.mark.parametrize("words", ["demo rtc-lite --virtual", "demo fig120"])
def test_who_reads_no_further_ends_a_command_without_a_word(words: str) -> None:
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "tickrig", *words.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline()
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert process.returncode in (0, 1)
