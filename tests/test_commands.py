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
    "--json": r"flag: (?!.*(one a line|object a)).*JSON",
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
