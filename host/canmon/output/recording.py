"""The options of a recording, and what they make."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.host.canmon.model.recorder.plan import AtLimit, Plan, read_plan
from tickrig.host.canmon.output.log_file import LogFile
from tickrig.host.cli.options import PATH, Decorator, add_options
from tickrig.host.cli.refused import Refused

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode.filter import Filter
    from tickrig.host.canmon.model.recorder.trigger import FilterTrigger, Trigger

RULE_FILE: Final = ".toml"

recording_options: Final[Decorator] = add_options(
    click.option(
        "--rotate",
        multiple=True,
        metavar="SIZE|TIME",
        help="With -l: begin a new file after 100M, 10min or 1h; FILE gets a number.",
    ),
    click.option("--disk", metavar="SIZE", help="With -l: all its files together, as 2G."),
    click.option(
        "--at-limit",
        type=click.Choice([limit.value for limit in AtLimit]),
        help="What happens there: the oldest file goes (default), or the recording ends.",
    ),
    click.option(
        "--trigger",
        multiple=True,
        metavar="WHEN",
        help="With -l: record around this alone: a filter as -F, or rules.toml of check.",
    ),
    click.option("--pre", metavar="N|TIME", help="Frames, or time, before a trigger.  [5s]"),
    click.option("--post", metavar="N|TIME", help="And behind it.  [5s]"),
)
"""Add what `Recording` takes."""

WORDS_METAVAR: Final = "FILE [--rotate 100M] [--disk 2G] [--trigger emcy]"

NAMES: Final = ("rotate", "disk", "at_limit", "trigger", "pre", "post")


class Recording:
    """What the options of a recording say.

    Args:
        path: of the file.
        options: by their names.
        bit_rate: of the bus, for a limit of the load among the rules.
        parts: it is in parts, whatever the options say.

    Attributes:
        plan: what it shall be.
        triggers: what it waits for.
        decodes: whether a trigger asks what frames mean.

    Raises:
        Refused: one that is wrong.
    """

    def __init__(
        self, path: Path, options: dict[str, Any], bit_rate: int | None, parts: bool = False
    ) -> None:
        words: Sequence[str] = options["trigger"]
        self.plan = read_recording_plan(path, options, parts)
        self.triggers = [_trigger(word, bit_rate) for word in words]
        self.decodes = any(trigger.decodes for trigger in self.triggers)

    def open(self, source: Sequence[str], live: bool, wanted: FilterTrigger | None) -> LogFile:
        """Begin it.

        Args:
            source: SOURCE words of what is recorded.
            live: time goes on while no frame comes.
            wanted: which frames are recorded; None for all.

        Raises:
            Refused: the format cannot be written here, or the file is read meanwhile.
            SourceFailed: it cannot be written.
        """
        return LogFile(self.plan, source, live, self.triggers, wanted)


def read_recording(words: str, bit_rate: int | None) -> Recording:
    """Read a recording in parts as people write it: a file and options; Refused if it is none."""
    try:
        command = click.Command("record", params=_params())
        context = command.make_context("record", shlex.split(words))
    except (click.ClickException, click.exceptions.Exit) as error:
        text = error.format_message() if isinstance(error, click.ClickException) else "--help"
        raise Refused(f"{text.rstrip('.')}: write {WORDS_METAVAR}") from None
    except ValueError as error:
        raise Refused(f"{words!r}: {error}") from None
    return Recording(context.params.pop("file"), context.params, bit_rate, parts=True)


def _params() -> list[click.Parameter]:
    @click.argument("file", type=PATH)
    @recording_options
    def record() -> None:
        """Hold the options."""

    return click.command(record).params


def read_recording_plan(path: Path, options: dict[str, Any], parts: bool = False) -> Plan:
    """Read what options say of the files; Refused if one is wrong."""
    try:
        return read_plan(
            path,
            rotate=options["rotate"],
            disk=options["disk"],
            at_limit=options["at_limit"],
            pre=options["pre"],
            post=options["post"],
            waits=bool(options["trigger"]),
            parts=parts,
        )
    except ValueError as error:
        text = str(error)
        option = text.partition(" ")[0]
        raise Refused(f"--{text}" if option in ("at-limit", *NAMES) else text) from None


def filter_trigger(text: str, wanted: Filter) -> FilterTrigger:
    """Return a filter as a trigger."""
    from tickrig.host.canmon.model.recorder.trigger import FilterTrigger  # noqa: PLC0415 - slow

    return FilterTrigger(text, wanted)


def _trigger(word: str, bit_rate: int | None) -> Trigger:
    if word.endswith(RULE_FILE):
        return _rules(word, bit_rate)
    from tickrig.host.canmon.model.check.expression.error_resets import errors_alone  # noqa: PLC0415 - slow
    from tickrig.host.canmon.model.decode.filter import FilterError, parse_filter  # noqa: PLC0415
    from tickrig.host.canmon.model.frames.tokens import tokens_of  # noqa: PLC0415

    try:
        wanted = parse_filter(word)
        matches = errors_alone(wanted.matches, tokens_of(word), wanted.signals)
        return filter_trigger(word, replace(wanted, matches=matches))
    except FilterError as error:
        raise Refused(f"--trigger: {error}") from None


def _rules(word: str, bit_rate: int | None) -> Trigger:
    from tickrig.host.canmon.extensions import load_rule  # noqa: PLC0415 - slow
    from tickrig.host.canmon.model.check.alarms import Alarms  # noqa: PLC0415
    from tickrig.host.canmon.model.check.rule_file import parse_rule_file  # noqa: PLC0415
    from tickrig.host.canmon.model.check.rules import Rules, parse_rules  # noqa: PLC0415
    from tickrig.host.canmon.model.recorder.trigger import RuleTrigger  # noqa: PLC0415

    try:
        words = parse_rule_file(Path(word).read_text("utf-8"), load_rule)
        rules = parse_rules(words, load_rule)
        if rules == Rules(bit_rate=rules.bit_rate):
            raise ValueError("it has no rule")
        return RuleTrigger(Path(word).name, Alarms(rules, bit_rate))
    except OSError as error:
        raise Refused(f"--trigger {word}: {error.strerror}") from error
    except ValueError as error:
        raise Refused(f"--trigger {word}: {error}") from None
