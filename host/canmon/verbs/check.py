"""The verb `check`, which checks rules against traffic."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.extensions import load_rule
from tickrig.host.canmon.model.check.checker import DecodedCheck, Unjudged
from tickrig.host.canmon.model.check.report import junit, sarif
from tickrig.host.canmon.model.check.rule import TrafficFinding
from tickrig.host.canmon.model.check.rules import (
    SWITCHES,
    VALUES,
    Rules,
    RuleValues,
    joined,
    parse_rule_file,
    parse_rules,
)
from tickrig.host.canmon.model.frames import (
    DumpLines,
    Record,
    Stamp,
    decoded_text,
    ident_text,
    seconds_text,
)
from tickrig.host.canmon.output import listening
from tickrig.host.canmon.sources.source import (
    AnySource,
    BlockLog,
    LogCut,
    Source,
    block_log,
    is_live,
    open_source,
)
from tickrig.host.canmon.verbs import decode_options
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, refusing, until_unread
from tickrig.host.cli.options import PATH, Choice, Decorator, add_options, refuse_idle
from tickrig.host.text.page_text import json_text, one_line
from tickrig.host.text.toml_reader import read_toml
from tickrig.host.text.values import counted
from tickrig.host.text.whole_file import write_whole

if TYPE_CHECKING:
    from tickrig.host.canmon.model import survey
    from tickrig.host.canmon.model.check import column_check, diagnosis, learnt
    from tickrig.host.canmon.model.columns.columns import Columns
    from tickrig.host.canmon.model.decode.decoded import Decoded
    from tickrig.host.canmon.model.decode.decoder import Decoder
else:  # numpy; decoders
    survey = LazyModule("tickrig.host.canmon.model.survey")
    column_check = LazyModule("tickrig.host.canmon.model.check.column_check")
    diagnosis = LazyModule("tickrig.host.canmon.model.check.diagnosis")
    learnt = LazyModule("tickrig.host.canmon.model.check.learnt")


# Findings of `check`, shown as they occur, as text or as objects in JSON.


class _FindingPrinter:
    """Printer that shows findings as they occur.

    Args:
        jsonl: whether to show the findings as JSON.
        stamp: format of times in text, or None for seconds since the epoch.
        kept: whether to keep the findings for a report.
        rules: names of all rules.
        most: number of findings to show, or None to show all.

    Attributes:
        counts: number of findings by rule.
        findings: all findings, if `kept`.
        frames: number of checked frames.
        unjudged: rules that could not be judged, known at the end.
    """

    unjudged = Unjudged({})

    def __init__(
        self,
        jsonl: bool,
        stamp: Stamp | None = None,
        *,
        kept: bool,
        rules: Sequence[str] = (),
        most: int | None = None,
    ) -> None:
        self._rules, self._most = rules, most
        self.counts: Counter[str] = Counter()
        self.findings: list[TrafficFinding] = []
        self.frames = self._shown = 0
        self._lines = None if stamp is None else DumpLines(stamp)
        self._text = finding_json if jsonl else partial(TrafficFinding.shown, lines=self._lines)
        self._kept = kept

    def count(self, frames: int, first_us: int) -> None:
        """Count checked frames.

        Args:
            frames: number of frames, at least 1.
            first_us: time of the first of these frames. Findings may be displayed with times since
                the first frame of the traffic. The first call stores the time of that frame.
        """
        if self._lines is not None and not self.frames:
            self._lines.stamp(first_us)
        self.frames += frames

    def begin_again(self) -> None:
        """Restart the check. Findings that were already shown occur again, but stay hidden."""
        self._shown = self.counts.total()
        self.counts.clear()
        self.findings.clear()
        self.frames = 0

    def take(self, findings: Sequence[TrafficFinding]) -> None:
        """Show findings."""
        room = None if self._most is None else max(0, self._most - self.counts.total())
        self.counts.update(finding.rule for finding in findings)
        self.findings += findings if self._kept else ()
        new = findings[self._shown : room]
        self._shown -= min(self._shown, len(findings))
        if new:
            with until_unread():
                click.echo("\n".join(map(self._text, new)))

    def nothing_judged(self) -> str:
        """Return why no rule judged anything, empty if a rule did."""
        none = self.none_judged
        if any(name not in none for name in self._rules):
            return ""
        return f"nothing was judged: {'; '.join(f'{name}: {why}' for name, why in none.items())}"

    @property
    def none_judged(self) -> dict[str, str]:
        """Reasons why rules could not judge any frame, by name of the rule.

        A rule with a finding is not included.
        """
        return {name: why for name, why in self.unjudged.rules.items() if name not in self.counts}

    def doubts(self) -> list[str]:
        """Report what was not shown, judged and not judged, with one line each."""
        held = [name for name in self._rules if name not in self.none_judged]
        none = _more_findings(self._most or self.counts.total(), self.counts.total())
        none += [f"judged: {', '.join(held)}"] * bool(held)
        none += [f"{name} judged nothing: {why}" for name, why in self.none_judged.items()]
        return none + [f"not judged: {text}" for text in self.unjudged.notes]

    def summary(self) -> str:
        """Report the result."""
        if self.counts:
            counts = ", ".join(f"{rule}: {count}" for rule, count in sorted(self.counts.items()))
            return f"{counted(self.counts.total(), 'finding')}: {counts}"
        none = len(self.none_judged)
        if not none:
            return "all rules hold"
        return f"{counted(len(self._rules) - none, 'rule')} held, {none} judged nothing"


def _more_findings(shown: int, count: int) -> list[str]:
    """Return a line about the findings that are not shown, if there are any."""
    left = max(0, count - shown)
    return [f"and {counted(left, 'finding')} more: --max {count}"] * bool(left)


def finding_json(finding: TrafficFinding) -> str:
    """Return a finding as an object. Frames are in candump notation."""
    said: dict[str, object] = {
        "v": 1,
        "t": finding.at_us / 1e6,
        "rule": finding.rule,
        "text": finding.text,
    }
    if finding.record is not None:
        said |= _frame(finding.record)
    if finding.around:
        said["around"] = _around_json(finding.around)
    return json_text(said, letters=True)


def _around_json(around: Sequence[tuple[Record, Decoded]]) -> list[dict[str, object]]:
    return [
        {"t": record.at_us / 1e6, **_frame(record), "text": decoded_text(decoded)}
        for record, decoded in around
    ]


def _frame(record: Record) -> dict[str, str]:
    return {"ch": record.channel, "frame": str(record.frame)}


_TEXTS: Final = {
    "no_emcy": "Report each EMCY except error reset.",
    "no_sdo_abort": "Report each aborted SDO transfer.",
    "no_error_frames": "Report each error frame.",
    "no_reboot": "Report a node that boots again without an NMT reset.",
    "no_lost_heartbeat": (
        "Report a node that stops sending heartbeats, or misses one; periods are learnt."
    ),
    "no_loss": "Report lost frames, and invalid lines of a log.",
}

_rule_options: Final[Decorator] = add_options(
    click.option(
        "--max-load", type=float, metavar="PERCENT", help="Limit the load of each second; needs -b."
    ),
    *(
        click.option(f"--{name.replace('_', '-')}", name, is_flag=True, help=text)
        for name, text in _TEXTS.items()
    ),
    click.option(
        "--heartbeat",
        multiple=True,
        metavar="NODE=TIME±OFF",
        help="Check a heartbeat period, such as 3=100ms±20% or 3=100ms+-5ms.",
    ),
    click.option(
        "--nodes", multiple=True, metavar="NODES", help="Require nodes on the bus, such as 3,16-18."
    ),
    click.option(
        "--max-gap",
        multiple=True,
        metavar="CAN-ID=TIME",
        help="Limit the gaps of a CAN-ID, such as 181=20ms.",
    ),
    click.option(
        "--known",
        multiple=True,
        metavar="CAN-IDS",
        help="Allow only these CAN-IDs, such as 080,181-18F.",
    ),
    click.option(
        "--rule",
        multiple=True,
        metavar="RULE",
        help="Check a rule, such as 'node 3 operational within 2s' or 'emcy never', or the name"
        " of a rule of an installed package.",
    ),
)
"""Decorator that adds each rule as an option."""


def _read_rules(files: Sequence[Path], options: Mapping[str, object]) -> Rules:
    """Return the combined rules of files and options.

    Raises:
        Refused: a rule is invalid, or a file cannot be read or has no rule.
    """
    words: RuleValues = {}
    for path in files:
        words = joined(words, _file(path))
    given = {name: options[name] for name in (*SWITCHES, *VALUES) if options.get(name)}
    if options.get("max_load") is not None:  # 0 is a limit, too
        given["max_load"] = options["max_load"]
    with refusing():
        rules = parse_rules(joined(words, given), load_rule)
    if files and _is_empty(rules):
        raise Refused(f"no rule in {' or '.join(map(str, files))}: leave it out for the usual ones")
    return rules


def _read_learnt(
    files: Sequence[Path], options: Mapping[str, object], *, init: bool
) -> learnt.Learnt | None:
    """Return the rules learnt from a good log, or None if the files have other rules.

    Raises:
        Refused: the file of learnt rules is invalid, or is not the only file.
    """
    others = [
        f"--{name.replace('_', '-')}"
        for name in (*SWITCHES, *VALUES)
        if name != "bitrate" and options.get(name)  # no rule by itself
    ]
    others += ["--max-load"] * (options.get("max_load") == 0)  # a limit, too
    if init and (files or others):
        raise Refused(f"--init learns all rules: leave {(*map(str, files), *others)[0]} out")
    found = None
    for path in files:
        try:
            text = path.read_text("utf-8")
            found = learnt.parse_learnt(text) or found
        except OSError:
            return None  # reported by the reader of other rules, like invalid TOML
        except ValueError as error:
            if read_toml(text).mistakes:
                return None
            raise Refused(f"rules {path}: {error}") from None
    if found is not None and (others or len(files) > 1):
        rest = others[0] if others else "another file"
        beside = "learnt rules are checked only with those that need no parameter"
        raise Refused(f"{beside}: leave {rest} out, or check twice")
    return found


def _is_empty(rules: Rules) -> bool:
    return rules == Rules(bit_rate=rules.bit_rate)


def _file(path: Path) -> RuleValues:
    """Read a file. Check it separately, so that the message names the file."""
    with refusing("rules", path=path):
        return parse_rule_file(path.read_text("utf-8"), load_rule)


_BROKEN: Final = 1
"""Exit status if a rule is broken."""

_RULE_FILE: Final = ".toml"
_STDIN: Final = "-"
_NAMES: Final = frozenset(BusOptions.__dataclass_fields__)
_MOST_AROUND: Final = 1_000
_AROUND: Final = 2


@decode_options.source_command(
    _rule_options,
    decode_options.decode_options,
    listening.span_option,
    decode_options.cut_options,
    click.option(
        "--around",
        type=click.IntRange(0, _MOST_AROUND),
        help="Frames to show before and after a finding.  [2 with --rule, else none]",
    ),
    click.option(
        "--init", is_flag=True, help="Learn rules from a good log, and write them to -o or stdout."
    ),
    click.option(
        "-o", "output", type=PATH, metavar="FILE", help="Write the rules of --init to FILE."
    ),
    click.option(
        "--max",
        "most",
        type=click.IntRange(1),
        help="Number of findings shown (default: all; without a rule, 20 with 3 frames each).",
    ),
    click.option("--junit", "report_path", type=PATH, metavar="FILE", help="Write a JUnit report."),
    click.option("--sarif", "sarif_path", type=PATH, metavar="FILE", help="Write a SARIF report."),
    click.option("--jsonl", is_flag=True, help="Print findings as JSON, one per line."),
    click.option(
        "-t",
        "stamp",
        type=Choice([Stamp.ABSOLUTE.value, Stamp.ZERO.value, Stamp.DATE.value]),
        help="Print times: (a)bsolute, (z)ero at the first frame, (A)bsolute with date.",
    ),
    decode_options.reopen_option,
)
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    eds: decode_options.EdsOptions,
    dbc: Sequence[Path],
    span_us: int | None,
    cut: LogCut,
    around: int | None,
    init: bool,
    output: Path | None,
    most: int | None,
    report_path: Path | None,
    sarif_path: Path | None,
    jsonl: bool,
    stamp: str | None,
    reopen: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Report what is wrong on a bus or in a log. The exit status is 1 if there is a finding.

    Without a rule, all rules that need no parameter are checked. They learn from the frames what is
    usual. A bus is recorded until Ctrl-C, or for the time of --for. Findings are grouped by rule
    and node, each with its frames. The checked rules are listed on standard error. The exit status
    is 5 if nothing could be judged.

    --init learns what is usual in a good log: nodes, identities, CAN-IDs, lengths, periods, load,
    order of boot-ups, EMCYs. Pass the resulting file to the next check. canmon then checks its
    rules and the rules that need no parameter. Other rules need a check of their own.

    With other rules, only these rules are checked. They are options, or a TOML file with the same
    names: no_emcy = true, heartbeat = ["3=100ms±20%"].

    \b
    canmon check run.log
    canmon check can0 -b 500000 --for 60s
    canmon check run.log --eds 3=drive.eds --max 5
    canmon check run.log --from 2.5 --to 30
    canmon check --init good.log -o good.toml
    canmon check next.log good.toml
    canmon check run.log --no-emcy --no-sdo-abort --nodes 3,16-18
    canmon check run.log rules.toml --junit out.xml
    canmon check can0 -b 500000 --for 60s --max-load 60 --heartbeat 3=100ms±20%
    canmon check run.log --eds 3=drive.eds --rule '3.statusword.fault never'

    {source}
    """  # noqa: D301 - click wants the backspace
    words = [word for word in source if not word.endswith(_RULE_FILE)]
    files = [Path(word) for word in source if word.endswith(_RULE_FILE)]
    known = _read_learnt(files, options, init=init)
    rules = Rules() if known or init else _read_rules(files, options)
    _refuse_idle(rules, words, init=init, jsonl=jsonl)
    bus = BusOptions(**{name: options[name] for name in _NAMES})
    bit_rate = _bit_rate(rules, words, bus)
    objects = decode_options.read_eds_files(eds) if any(eds) else {}
    if _is_empty(rules):
        make = partial(diagnosis.Diagnoser, bit_rate, objects, rules=known)
        held_frames = _Usual(words, bus, make, cut, reopen=reopen)
        held_frames.listen(span_us)
        if init:
            held_frames.learn(output)
            listening.report(held_frames.source, strict)
            return
        if around is not None:
            held_frames.show_around(around, decode_options.decoder_of(objects, dbc))
        held_frames.show(jsonl=jsonl, stamp=Stamp(stamp) if stamp else None, most=most)
        held_frames.write(report_path, sarif_path)
        held_frames.end(strict)
        return
    decoder = decode_options.decoder_of(objects, dbc) if rules.expressions else None
    heartbeats = {node: ms for node, one in objects.items() if (ms := one.heartbeat_ms)}
    kept = bool(report_path or sarif_path)
    shown = Stamp(stamp) if stamp else None
    verdict = _FindingPrinter(jsonl, shown, kept=kept, rules=rules.names(), most=most)
    log = None if decoder else block_log(words, cut)
    if log is not None:
        checker = column_check.ColumnChecker(rules, bit_rate, heartbeats)
        log = _in_blocks(log, checker, verdict, span_us)
    frames = log or open_source(words, bus, cut)
    if reopen:
        frames.reopen()
    with closing(frames):
        if not isinstance(frames, BlockLog):
            rates = listening.bit_rates_of(words, bus)
            shown_around = _AROUND if around is None else around
            held = DecodedCheck(rules, rates, decoder, shown_around, heartbeats)
            _one_by_one(frames, words, held, verdict, span_us)
    unjudged = verdict.nothing_judged() if verdict.frames else _no_frame(frames, words)
    suite, why = " ".join(words), frames.failed or unjudged
    judged = suite, rules.names(), verdict.findings, why, verdict.none_judged
    _write(report_path, sarif_path, judged)
    said = verdict.doubts() if verdict.counts or not unjudged else []
    listening.report(
        frames, strict, [*said, verdict.summary()] if verdict.counts or not why else said
    )
    if verdict.counts:
        click.get_current_context().exit(_BROKEN)
    if unjudged:
        raise _NothingJudged(unjudged)


# Findings without given rules.

_MOST_FRAMES: Final = 20_000_000
"""Number of frames of a bus that are kept, which take 700 MB."""
_SHOWN: Final = 20
_SHOWN_FRAMES: Final = 3
"""Default number of findings, and of frames per finding, that are shown."""

_Around = tuple[int, "Sequence[tuple[Record, Decoded]]"]
"""Frames around a finding with their meanings, and the number of the first of them in the log."""


class _Usual:
    """A comparison of frames with the usual traffic.

    Args:
        words: SOURCE words.
        bus: options of buses.
        make: function that makes the object that judges the frames.
        cut: part of a log to read.
        reopen: whether to wait for a bus that goes away.

    Attributes:
        source: source of the frames.
    """

    def __init__(
        self,
        words: Sequence[str],
        bus: BusOptions,
        make: Callable[[], diagnosis.Diagnoser],
        cut: LogCut,
        *,
        reopen: bool,
    ) -> None:
        self._words, self._bus, self._reopen = words, bus, reopen
        self._cut = cut
        self._make, self._diagnoser = make, make()
        self._watch, self._end_us = listening.Stopwatch(), 0
        self._around = 0
        self._decoder: Decoder | None = None
        self.source: AnySource[Columns] | Source

    def show_around(self, frames: int, decoder: Decoder) -> None:
        """Show frames of the log before and after the first frame of each finding.

        Args:
            frames: number of frames before the frame, and also after it.
            decoder: decoder for the shown frames.
        """
        self._around, self._decoder = frames, decoder

    def listen(self, span_us: int | None) -> None:
        """Read until the user interrupts or the time is over."""
        log = block_log(self._words, self._cut)
        if log is not None:
            with closing(log):
                if listening.take_blocks(log, self._diagnoser.take, span_us):
                    self.source = log
                    return
            self._diagnoser = self._make()  # CAN FD: read it again, frame by frame
        source = open_source(self._words, self._bus, self._cut)
        if self._reopen:
            source.reopen()
        self.source = source
        with closing(source), listening.until_interrupted():
            listening.listen(source, self._take, span_us)
        if source.live and list(self._words) != [_STDIN] and self._diagnoser.kept.frames:
            self._end_us = self._watch.now_us

    def _take(self, records: Sequence[Record]) -> None:
        self._watch.take(records)
        if self._diagnoser.kept.frames < _MOST_FRAMES:
            self._diagnoser.take(records)

    def show(self, *, jsonl: bool, stamp: Stamp | None, most: int | None) -> None:
        """Show the findings."""
        source = self.source
        lost = [f"{source.lost} frames were lost"] if source.lost else []
        self._diagnoser.without_errors = source.without_errors
        self._found = found = self._diagnoser.diagnosis(lost, source.errors(), self._end_us)
        lines = DumpLines(stamp) if stamp else None
        if lines and found.frames:
            lines.stamp(min(bus.at_us[0] for bus in self._diagnoser.kept))
        text_of = (
            _fault_json if jsonl else partial(_fault_text, lines=lines, most=most or _SHOWN_FRAMES)
        )
        shown = found.faults if jsonl else found.faults[: most or _SHOWN]
        around = self._frames_around(shown)
        if shown:
            with until_unread():
                texts = (text_of(one, around=_first_of(one, around)) for one in shown)
                click.echo("\n".join(texts))
        self._said = _more_findings(len(shown), len(found.faults))

    def _frames_around(self, shown: Sequence[diagnosis.BusFault]) -> Mapping[int, _Around]:
        """Read the log again for the frames around the first frames of findings."""
        numbers = [one.frames[0].number for one in shown if one.frames]
        if self._decoder is None or not self._around:
            return {}
        with closing(open_source(self._words, self._bus, self._cut)) as again:
            pieces = iter(lambda: None if again.ended else again.poll(0), None)
            found = survey.excerpts(pieces, numbers, self._around)
        return self._decoder.take_excerpts(found)

    def learn(self, output: Path | None) -> None:
        """Write the usual traffic as rules."""
        frames, words = self._diagnoser.kept.frames, " ".join(self._words)
        if not frames:
            raise _NothingJudged(_no_frame(self.source, self._words).replace("judged", "learnt"))
        summaries = self._diagnoser.summaries()
        head = [
            f"Learnt from {one_line(words)}, {counted(frames, 'frame')}, by canmon check --init.",
            "canmon check NEXT.log THIS.toml holds the next log against it, and against the rules",
            "that need no parameter. Change what you know better.",
        ]
        text = learnt.learnt_text(summaries, head)
        if output is None:
            with until_unread():
                click.echo(text, nl=False)
        else:
            with refusing("-o"):
                write_whole(output, text)
        for bus in summaries:
            for found in bus.found:
                click.echo(f"{bus.name}: taken for usual: {found}", err=True)

    def write(self, junit_path: Path | None, sarif_path: Path | None) -> None:
        """Write the reports."""
        found = self._found
        findings = [
            TrafficFinding(fault.first_us, fault.rule, str(fault).partition(": ")[2])
            for fault in found.faults
        ]
        why = self.source.failed or self._nothing()
        suite = " ".join(self._words)
        judged = suite, list(diagnosis.RULES), findings, why, found.unjudged
        _write(junit_path, sarif_path, judged)

    def _nothing(self) -> str:
        return "" if self._found.frames else _no_frame(self.source, self._words)

    def end(self, strict: bool) -> None:
        """Report what was judged. End with the exit status."""
        found, nothing = self._found, self._nothing()
        said = [*self._said, f"judged: {', '.join(found.judged)}"]
        by_reason: dict[str, list[str]] = {}
        for name, why in found.unjudged.items():
            by_reason.setdefault(why, []).append(name)
        said += [f"not judged, {why}: {', '.join(names)}" for why, names in by_reason.items()]
        counts = Counter(fault.rule for fault in found.faults)
        rules = ", ".join(f"{rule}: {count}" for rule, count in sorted(counts.items()))
        said.append(f"{counted(counts.total(), 'finding')}{': ' * bool(rules)}{rules}")
        listening.report(self.source, strict, [] if nothing else said)
        if found.faults:
            click.get_current_context().exit(_BROKEN)
        if nothing:
            raise _NothingJudged(nothing)


def _first_of(fault: diagnosis.BusFault, around: Mapping[int, _Around]) -> _Around | None:
    return around.get(fault.frames[0].number) if fault.frames else None


def _fault_text(
    fault: diagnosis.BusFault, lines: DumpLines | None, most: int, around: _Around | None
) -> str:
    """Return a finding as text, with a line for the time, the frames, and each frame around."""

    def time(at_us: int) -> str:
        return lines.stamp(at_us).strip() if lines else f"({seconds_text(at_us, 1)})"

    times = "" if fault.amount == 1 else f" [{fault.amount} times]"
    said = [f"{time(fault.first_us)} {fault}{times}"]
    shown = [f"{place.number} {time(place.at_us)}" for place in fault.frames[:most]]
    more = len(fault.frames) - len(shown)
    shown += [f"and {more} more"] * bool(more)
    said += [f"    frames: {', '.join(shown)}"] * bool(shown)
    if around is not None:
        first, records = around
        marked = records[fault.frames[0].number - first][0]
        said += (lines or DumpLines(Stamp.ABSOLUTE)).around(records, marked)
    return "\n".join(said)


def _fault_json(fault: diagnosis.BusFault, around: _Around | None) -> str:
    """Return a finding as an object."""
    shown = {} if around is None else {"around": _around_json(around[1])}
    return json_text(
        {
            "v": 1,
            "t": fault.first_us / 1e6,
            "last": fault.last_us / 1e6,
            "rule": fault.rule,
            "ch": fault.channel,
            "node": fault.node,
            "id": None if fault.ident is None else ident_text(fault.ident),
            "text": fault.text,
            "n": fault.amount,
            "frames": [{"n": place.number, "t": place.at_us / 1e6} for place in fault.frames],
            **shown,
        },
        letters=True,
    )


_SHOWN_BY: Final = ("around", "most", "report_path", "sarif_path", "jsonl", "stamp")
"""Options for displaying findings."""


def _refuse_idle(rules: Rules, words: Sequence[str], *, init: bool, jsonl: bool) -> None:
    """Raise Refused for options without an effect."""
    if init:
        refuse_idle("--init shows no finding", *_SHOWN_BY)
    else:
        refuse_idle("it is for the rules of --init", "output")
    if jsonl:
        refuse_idle("--jsonl has its own times, and all findings", "stamp", "most")
    if rules.expressions:
        return
    if not _is_empty(rules):
        refuse_idle("it is for a --rule", "around", "dbc")
    elif any(map(is_live, words)):
        refuse_idle("it is for a log, or a --rule", "around", "dbc")
    elif click.get_current_context().params["around"] is None:
        refuse_idle("it is for --around, or a --rule", "dbc")


class _NothingJudged(click.ClickException):
    """No rule judged anything.

    The error prints one line on standard error, with exit status 5.
    """

    exit_code = 5


def _no_frame(source: AnySource[object], words: Sequence[str]) -> str:
    """Report why nothing was judged."""
    where = "no frame came" if source.live else f"no frame in {' '.join(words)}"
    return f"nothing was judged: {where}"


def _bit_rate(rules: Rules, words: Sequence[str], bus: BusOptions) -> int | None:
    """Return the bit rate. Raise Refused if a rule needs it and it is missing."""
    bit_rate = listening.bit_rates_of(words, bus).nominal
    with refusing():
        rules.load(bit_rate)
    return bit_rate


def _in_blocks(
    log: BlockLog,
    checker: column_check.ColumnChecker,
    verdict: _FindingPrinter,
    span_us: int | None,
) -> BlockLog | None:
    """Judge a log. Return None if the log must be read again, frame by frame."""

    def take(block: Columns) -> None:
        if len(block):
            verdict.count(len(block), int(block.at_us[0]))
        verdict.take(checker.take(block))

    if listening.take_blocks(log, take, span_us):
        verdict.take(checker.end(log.losses(), log.errors()))
        verdict.unjudged = checker.unjudged(log.without_errors)
        return log
    verdict.begin_again()
    return None


def _one_by_one(
    source: Source,
    words: Sequence[str],
    held: DecodedCheck,
    verdict: _FindingPrinter,
    span_us: int | None,
) -> None:
    watch, has_clock = listening.Stopwatch(), source.live and list(words) != [_STDIN]

    def take(records: Sequence[Record]) -> None:
        watch.take(records)
        if records:
            verdict.count(len(records), records[0].at_us)
        verdict.take(held.take(records))
        if not records and verdict.frames:
            verdict.take(held.wait(watch.now_us, has_clock))

    with listening.until_interrupted():
        listening.listen(source, take, span_us or listening.patience_us(source, words))
    lost, latest_us = source.losses(), watch.latest_us
    end_us = watch.now_us if source.live else latest_us
    errors, judged_us = source.errors(), end_us if has_clock else latest_us
    verdict.take(held.end(end_us, lost, judged_us, errors))
    verdict.unjudged = held.unjudged(end_us, source.without_errors)


_Judged = tuple[str, list[str], list[TrafficFinding], str, Mapping[str, str]]


def _write(junit_path: Path | None, sarif_path: Path | None, judged: _Judged) -> None:
    """Write the reports that options request."""
    for option, path, text in (("--junit", junit_path, junit), ("--sarif", sarif_path, sarif)):
        if path is not None:
            with refusing(option):
                write_whole(path, text(*judged))
