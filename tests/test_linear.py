"""Whatever a text holds, it is read in a time that grows with its length, no faster.

Nothing here looks at a clock: what takes the square of its length is stopped by the time-out of
the test, a hundred times what it takes else.
"""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from itertools import chain
from pathlib import Path
from re import _constants, _parser  # type: ignore[attr-defined]  # how Python reads a pattern
from typing import Any, Final, NamedTuple

import pytest

from tests.emulators.lamp import Lamp
from tests.emulators.scenario.test_scenario import parse as parse_scenario
from tickrig.emulators.bench.operator import parse_fault_spec
from tickrig.emulators.canopen.bus_file.node_keys import BusMistakesError
from tickrig.emulators.canopen.bus_file.urdf import parse_urdf
from tickrig.emulators.canopen.store_file import StoreFile
from tickrig.emulators.record.comparison import parse_number_rule
from tickrig.emulators.record.replay import read_bench_recording, read_recording
from tickrig.emulators.serial.emulator import Emulator
from tickrig.emulators.testing.campaign.journal import _entries
from tickrig.emulators.testing.campaign.order import CampaignRefusal
from tickrig.emulators.testing.campaign.table import read_table
from tickrig.emulators.testing.machine.host_runs import parse_steps
from tickrig.emulators.testing.report.overview import parse_requirements
from tickrig.emulators.testing.report.report_file import from_json
from tickrig.emulators.testing.rig_file.reader import parse_rig_file
from tickrig.emulators.testing.signals.formula import parse_formula
from tickrig.emulators.testing.signals.table import read_points
from tickrig.emulators.tkernel.ucode_table import parse_table as parse_ucodes
from tickrig.host.canmon.eds_document import read_document
from tickrig.host.canmon.model.check.learnt import parse_learnt
from tickrig.host.canmon.model.check.rule_parser import parse_rule
from tickrig.host.canmon.model.check.rules import parse_rule_file
from tickrig.host.canmon.model.decode.dbc_file import DbcFile
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.graph.series import parse_signal
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.host.canmon.model.recorder.files import _objects
from tickrig.host.canmon.model.sequence import TomlSequence, evaluate, fill_in, parse_lines
from tickrig.host.canmon.model.transmit import parse_row_text
from tickrig.host.canmon.workspace import Workspace
from tickrig.host.canopen.bus_file.bus_file import decode_bus_file
from tickrig.host.canopen.conform.report.baseline import Baseline
from tickrig.host.canopen.data_sheet.check import check
from tickrig.host.canopen.eds import read_sound
from tickrig.host.canopen.gateway import GatewayError, parse_request
from tickrig.host.cli.messages import Refused
from tickrig.host.control.requests import RequestDispatcher
from tickrig.host.rtc.canopen.builder.profile_file import parse_project
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.configuration import Constraint
from tickrig.host.rtc.engines.ros2.table_reader import parse_table as parse_topics
from tickrig.host.rtc.motion.components.odometry import read_conf
from tickrig.host.rtc.motion.path_file import read_path
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.rts_profile import parse_rts_profile
from tickrig.host.rtc.system.system_file import parse_toml
from tickrig.host.rtc.ucode.contents_interpretation import parse_contents
from tickrig.host.text.byte_text import unescape
from tickrig.host.text.names import near
from tickrig.host.text.toml_reader import read_toml
from tickrig.wire.can import parse_log

pytestmark = pytest.mark.timeout(60)

ROOT: Final = Path(__file__).parents[1]
FLOORS: Final = ("wire", "device", "host", "emulators")
MEGABYTE: Final = 1_000_000
SLOW: Final = 100_000
"""Characters for readers that look at each line a dozen times."""

SHORT: Final = 20_000
"""Characters of all else, behind what has a reader look at it."""

UNITS: Final = ("\n", " ", "a", "0", "[", "{", "(", "<a>", '"', ",", ";", "\\", "[a]\n", "a = 1\n")
WHOLE: Final = ("\n", "a", "[")
"""Those that come by the megabyte."""

TOLD: Final = (ValueError, GatewayError, Refused, CampaignRefusal, RtcRefused, BusMistakesError)
"""How a reader says that a text is none of its own: all of it in one line."""


class Reader(NamedTuple):
    """A reader of texts that people, files and devices bring.

    Attributes:
        read: reads a text; what needs a file is given one.
        begin: what stands before the text, so that it is looked at.
        size: characters.
        long: what else it is given so many of: a beginning, and what follows it.
    """

    read: Callable[[str], object]
    begin: tuple[str, ...] = ()
    size: int = MEGABYTE
    long: tuple[tuple[str, str], ...] = ()


def of_file(read: Callable[[Path], object], name: str) -> Callable[[str], object]:
    """Return what reads a text as a file in the current folder."""

    def read_text(text: str) -> object:
        (path := Path(name)).write_text(text, "utf-8", newline="")
        return read(path)

    return read_text


def log(name: str, *begin: str) -> Reader:
    return Reader(of_file(lambda path: sum(1 for _ in read_log(path)), f"a.{name}"), begin)


def no_rule(name: str) -> Any:
    raise ValueError(name)


TRACE: Final = "# tickrig-trace v1 rrc "
READERS: Final = {
    "host.text.toml_reader": Reader(read_toml, ("a = ", "a = [", "a = {b=", 'a = "', "a.")),
    "host.text.trace": Reader(
        lambda text: read_recording(text.encode()), (TRACE, f"{TRACE}{{}}\n0.000001 < ")
    ),
    "host.text.bench_record": Reader(
        lambda text: read_bench_recording(text.encode()),
        ("# tickrig-trace v2 ", "# tickrig-trace v2 {}\n", f"{TRACE}{{}}\n0.000001 ! a="),
    ),
    "host.text.byte_text": Reader(unescape),
    "host.text.names": Reader(lambda text: near(text, ["stick", "left/stick", "x" * 40])),
    "host.control.requests": Reader(
        lambda text: RequestDispatcher({}).answer_line(text.encode()), ('{"v": 1, "do": ',)
    ),
    "host.canopen.gateway": Reader(
        parse_request, ("[1] ", '[1] 5 w 0x2000 0 vs "'), long=(("[1] ", "1 "), ("[1] r ", '"" '))
    ),
    "wire.can": Reader(parse_log, ("(1.000000) can0 123#",)),
    "wire.canopen.eds": Reader(
        of_file(read_sound, "a.eds"),
        ("[2000]\nDataType=7\nDefaultValue=", "[2000]\nObjectType="),
        SLOW,
    ),
    "host.canopen.data_sheet": Reader(
        of_file(lambda path: check(read_document(path)), "b.eds"),
        ("[2000]\nDataType=7\nDefaultValue=", "[M", "[2000]\n"),
        SLOW,
    ),
    "wire.canopen.eds.xdd": Reader(
        of_file(read_sound, "a.xdd"),
        ("<a><CANopenObjectList/>", '<a b="', "<a><![CDATA["),
        SLOW,
        (("<a>", "a\n"),),
    ),
    "emulators.canopen.bus_file.urdf": Reader(
        lambda text: parse_urdf(text.encode(), "a.urdf"),
        ("<robot>", '<robot name="'),
        long=(("<robot>", "\n"),),
    ),
    "host.text.yaml_reader": Reader(
        lambda text: decode_bus_file(text.encode(), Path("bus.yml")), ("nodes: ",), SLOW
    ),
    "host.rtc.canopen.definition_reader": Reader(parse_definition, ("nodes: ",), SLOW),
    "emulators.testing.rig_file": Reader(
        lambda text: parse_rig_file(text, Path("rig.toml")), ("[device.a]\ntype = ", "# ")
    ),
    "emulators.canopen.store_file": Reader(of_file(StoreFile, "store.json"), ('{"a": ',)),
    "emulators.scenario": Reader(
        lambda text: parse_scenario(text, Emulator("lamp", Lamp())),
        ("1ms send ", "1ms set ", "1ms expect ", "1ms fault ", "1ms press "),
    ),
    "emulators.bench.operator": Reader(parse_fault_spec, ("cut=", "cut@")),
    "emulators.record.comparison": Reader(parse_number_rule, ("a=", "a[1:2]=")),
    "emulators.testing.campaign.table": Reader(
        of_file(read_table, "t.csv"),
        ("test,seed,outcome,virtual_us,where,reason,replay\n", "test,seed,"),
    ),
    "emulators.testing.campaign.journal": Reader(lambda text: list(_entries(text.encode()))),
    "emulators.testing.machine.host_runs": Reader(
        lambda text: parse_steps(text, "s.txt"), ("+1ms call ", "+1ms call a(b=", "+1ms seed ")
    ),
    "emulators.testing.report.report_file": Reader(from_json, ('{"a": ',)),
    "emulators.testing.report.overview": Reader(
        lambda text: parse_requirements(text, "r.txt"), ("A-1 ", '["a"]\ntitle="')
    ),
    "emulators.testing.signals.table": Reader(
        of_file(lambda path: read_points(path, None), "p.csv"), ("t,a\n0,", 't,"')
    ),
    "emulators.testing.signals.formula": Reader(parse_formula, ("1 + ", "- ")),
    "emulators.tkernel.ucode_table": Reader(parse_ucodes, ("x = ", "a.")),
    "host.canmon.workspace": Reader(Workspace, ("x = ",)),
    "host.canopen.conform.report.baseline": Reader(of_file(Baseline.read, "b.txt")),
    "host.rtc.engines.ros2.table_reader": Reader(
        lambda text: parse_topics(text, "t.toml"), ('[[topic]]\nname = "',)
    ),
    "host.canmon.model.check.learnt": Reader(
        parse_learnt, ('[learnt.can0.frame.185]\nperiod = "', "[learnt.can0]\na = ")
    ),
    "host.canmon.model.check.rules": Reader(
        lambda text: parse_rule_file(text, no_rule), ('rules = ["', "x = ", "a.")
    ),
    "host.canmon.model.check.expression": Reader(parse_rule, ("never ", "node 1 of ", "not ")),
    "host.canmon.model.decode.filter": Reader(parse_filter, ("node=", "not ")),
    "host.canmon.model.decode.dbc_file": Reader(
        of_file(DbcFile, "a.dbc"), ("BO_ 1 A: 8 X\n SG_ a : ", 'CM_ "')
    ),
    "host.canmon.model.graph.signal_spec": Reader(parse_signal, ("123[0]*", "123[0]-", "1.")),
    "host.canmon.model.logs.log_reader": log("log", "(1.000000) can0 ", "  can0  123   [1]  "),
    "host.canmon.model.logs.can_log": log("asc", "base hex timestamps absolute\n0.1 1 123 Rx d 8 "),
    "host.canmon.model.logs.trc": log("trc", ";$FILEVERSION=2.1\n", "1) 1.0 Rx 0123 8 "),
    "host.canmon.model.logs.notation": log("jsonl", '{"v":1,"t":1,"ch":"', '{"a":'),
    "host.canmon.model.logs.csv": log("csv", "0.000000,can0,123,rx,1,"),
    "host.canmon.model.logs.trace_log": log("trace", "# tickrig-trace v2 "),
    "host.text.bench_header": log("trace", "# tickrig-trace v2 {"),
    "host.canmon.model.recorder.files": Reader(lambda text: list(_objects(text)), ('{"a": ',)),
    "host.canmon.model.sequence": Reader(
        lambda text: TomlSequence(text, "s.toml").parse(), ('[[step]]\nsend = "', "x = ", "a.")
    ),
    "host.canmon.model.sequence.lines": Reader(
        lambda text: parse_lines(text, "s.txt"), ("+1 123#",)
    ),
    "host.canmon.model.sequence_variables": Reader(
        lambda text: fill_in(f"{{{text}}}", {}), ("- ",)
    ),
    "host.canmon.model.sequence.evaluate": Reader(lambda text: evaluate(text, {}), ("1+", "-")),
    "host.canmon.model.transmit": Reader(parse_row_text, ("123#", "123#00 --every "), SLOW),
    "host.rtc.motion.components.odometry": Reader(of_file(read_conf, "a.conf"), ("conf.a.b: ",)),
    "host.rtc.motion.path_file": Reader(of_file(read_path, "p.txt"), ("1 2 ",)),
    "host.rtc.configuration": Reader(Constraint, ("x<", "(")),
    "host.rtc.system.rts_profile": Reader(parse_rts_profile, ("<a>",)),
    "host.rtc.system.system_file": Reader(parse_toml, ('[[component]]\nname = "', "x = ", "a.")),
    "host.rtc.ucode.contents_interpretation": Reader(parse_contents, ('{"a": ',)),
    "host.rtc.canopen.builder.profile_file": Reader(parse_project, ("x = ", "a.")),
}
"""Each by its module, or by a name beside it where a module reads several kinds."""


@pytest.mark.parametrize("name", READERS)
def test_a_megabyte_of_anything_is_read_or_told_in_a_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    reader = READERS[name]
    texts = [unit * reader.size for unit in WHOLE]
    texts += [begin + unit * (MEGABYTE // len(unit)) for begin, unit in reader.long]
    texts += [begin + unit * (SHORT // len(unit)) for unit in UNITS for begin in reader.begin]
    for text in texts:
        with suppress(*TOLD):
            reader.read(text)


PARSES: Final = re.compile(
    r"json\.loads\(|load_toml\(|read_toml\(|yaml\.compose\(|\bET\.fromstring|ParserCreate|"
    r"csv\.reader\(|ast\.parse\(|tomlkit\.parse|load_file\(|\.splitlines\(|content_lines\("
)
ELSEWHERE: Final = {
    "emulators.commands.doctor": "what our own child process says",
    "emulators.testing.bench.bench": "our own transcript",
    "emulators.testing.campaign.parquet_file": "a message of pyarrow",
    "emulators.testing.campaign.worker": "what pytest says",
    "emulators.testing.commands.replay": "whether a line begins with +",
    "emulators.testing.machine.host_runs": "our own transcript",
    "emulators.testing.plugin.report_plugin": "of a worker of pytest",
    "emulators.testing.plugin.settings": "lines of pytest.ini",
    "host.canmon.conform.stimulus": "of a program that the user names, its first line",
    "host.canmon.tui.app": "rules that `settings` has read",
    "host.canmon.tui.settings": "`parse_rules`, as of a file",
    "host.canmon.tui.panels.alarms_panel": "`parse_rules`, as of a file",
    "host.canmon.tui.panels.sequence_panel": "`TomlSequence`",
    "host.canmon.model.decode.node_memory": "our own table",
    "host.canmon.model.logs.log_file": "our own table",
    "host.canopen.conform.binding.wanted": "our own table",
    "host.rtc.engines.ros2.message_types": "our own table",
    "host.canmon.verbs.check": "whether a file is TOML; the rules read it",
    "host.control.client": "of our own emulator",
    "host.links.serial_link": "of the kernel",
    "host.canmon.model.check.report": "our own findings",
    "host.rtc.commands.verbs": "a word of the command line",
    "host.text.section": "values of a TOML text, as of a rig file",
    "host.text.steps": "`parse_steps`, `parse_scenario`",
}
"""Modules that parse what no stranger writes, or what a reader of the table is given."""


@cache
def modules() -> Mapping[str, str]:
    """Return the text of each module of ours by its name."""
    return {
        str(path.relative_to(ROOT))[:-3]
        .replace("/", ".")
        .removesuffix(".__init__"): path.read_text("utf-8")
        for floor in FLOORS
        for path in sorted((ROOT / floor).rglob("*.py"))
    }


def test_every_module_that_parses_is_in_the_table() -> None:
    parsing = {
        name for name, text in modules().items() if PARSES.search(re.sub(r">>>.*", "", text))
    }
    covered = (*READERS, *ELSEWHERE)
    missing = {
        name for name in parsing if not any(f"{name}.".startswith(f"{each}.") for each in covered)
    }
    assert missing == set()
    assert set(ELSEWHERE) <= parsing


class Use(NamedTuple):
    """A pattern, and how its module uses it."""

    pattern: re.Pattern[Any]
    methods: frozenset[str]


METHODS: Final = {"match", "fullmatch", "search", "sub", "split", "findall", "finditer"}


def uses(name: str, text: str) -> list[Use]:
    """Return the patterns of a module: its globals, and those that stand in a call."""
    tree, found = ast.parse(text), []
    calls = [each for each in ast.walk(tree) if isinstance(each, ast.Call)]
    ways: dict[str, set[str]] = {}
    for call in calls:
        if isinstance(call.func, ast.Attribute) and call.func.attr in METHODS:
            ways.setdefault(ast.unparse(call.func.value), set()).add(call.func.attr)
            if ast.unparse(call.func.value) == "re" and isinstance(call.args[0], ast.Constant):
                flags = re.MULTILINE if "MULTILINE" in ast.unparse(call) else re.NOFLAG
                pattern: re.Pattern[Any] = re.compile(str(call.args[0].value), flags)
                found.append(Use(pattern, frozenset([call.func.attr])))
    for key, value in vars(importlib.import_module(f"tickrig.{name}")).items():
        for pattern in _patterns(value, set()):
            found.append(Use(pattern, frozenset(ways.get(key, {"match"}))))
    return found


def _patterns(value: object, seen: set[int]) -> Iterator[re.Pattern[Any]]:
    """Give the patterns in a value; tables of states hold each other."""
    if id(value) in seen:
        return
    seen.add(id(value))
    match value:
        case re.Pattern():
            yield value
        case dict():
            for each in chain(value, value.values()):
                yield from _patterns(each, seen)
        case tuple() | list():
            for each in value:
                yield from _patterns(each, seen)


def attacks(tree: Any, begin: str = "") -> Iterator[tuple[str, str]]:
    """Give what comes before a repetition of a pattern, and what it repeats."""
    for op, value in tree:
        match op:
            case _constants.MAX_REPEAT | _constants.MIN_REPEAT | _constants.POSSESSIVE_REPEAT:
                low, high, body = value
                if high > 50:
                    first = letters(*body[0])[:4] if len(body) == 1 else []
                    yield from ((begin, pump) for pump in {*first, sample(body)} if pump)
                yield from attacks(body, begin)
                begin += sample(body) * low
            case _constants.SUBPATTERN:
                yield from attacks(value[3], begin)
                begin += sample(value[3])
            case _constants.ATOMIC_GROUP:
                yield from attacks(value, begin)
                begin += sample(value)
            case _constants.BRANCH:
                for each in value[1]:
                    yield from attacks(each, begin)
                begin += sample(value[1][0])
            case _constants.ASSERT | _constants.ASSERT_NOT:
                yield from attacks(value[1], begin)
            case _constants.AT | _constants.GROUPREF:
                pass
            case _:
                begin += "".join(letters(op, value)[:1])


def sample(tree: Any) -> str:
    """Return a short text that a piece of a pattern takes."""
    text = ""
    for op, value in tree:
        match op:
            case _constants.MAX_REPEAT | _constants.MIN_REPEAT | _constants.POSSESSIVE_REPEAT:
                text += sample(value[2]) * value[0]
            case _constants.SUBPATTERN:
                text += sample(value[3])
            case _constants.ATOMIC_GROUP:
                text += sample(value)
            case _constants.BRANCH:
                text += sample(value[1][0])
            case _constants.ASSERT | _constants.ASSERT_NOT | _constants.AT | _constants.GROUPREF:
                pass
            case _:
                text += "".join(letters(op, value)[:1])
    return text


TRIED: Final = "a0 \n\tA_x-.\"9[{(#;:=,+\\/'@<>e1fZz|!~$%&*?`])}h"


def letters(op: Any, value: Any) -> list[str]:
    """Return characters that one place of a pattern takes."""
    try:
        tree = _parser.parse("a")
        tree.data = [(op, value)]
        pattern = re._compiler.compile(tree)  # type: ignore[attr-defined]
    except (TypeError, ValueError, re.error):
        return []
    return [each for each in TRIED if pattern.fullmatch(each)]


IMPORTS: Final = re.compile(r"(?m)^import re$")
LONG: Final = 200_000


@pytest.mark.timeout(20)
@pytest.mark.parametrize("name", [name for name, text in modules().items() if IMPORTS.search(text)])
def test_every_pattern_is_linear(name: str) -> None:
    """A pattern fails, or finds all there is, in a long text of what it repeats."""
    for pattern, methods in uses(name, modules()[name]):
        is_bytes = isinstance(pattern.pattern, bytes)
        source = pattern.pattern.decode("latin-1") if is_bytes else pattern.pattern
        tree = _parser.parse(source, pattern.flags & ~re.UNICODE)
        for begin, pump in {*attacks(tree), ("", " "), ("", "\n")}:
            for end in ("\0", "\n\0"):
                found = begin + pump * (LONG // len(pump)) + end
                subject = found.encode("latin-1", "replace") if is_bytes else found
                for method in methods:
                    act = getattr(pattern, method)
                    new = (b"" if is_bytes else "",) if method == "sub" else ()
                    for _ in act(*new, subject) if method == "finditer" else (act(*new, subject),):
                        pass
