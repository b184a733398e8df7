"""The rules of `check` as options and as files."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final

import click

from tickrig.host.cli.options import Decorator, add_options
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.monitor.check.rules import Rules
from tickrig.host.monitor.check.words import SWITCHES, VALUES, Words, joined, parse_rules

_TEXTS: Final = {
    "no_emcy": "No EMCY but error reset.",
    "no_sdo_abort": "No aborted SDO transfer.",
    "no_error_frames": "No error frame.",
    "no_reboot": "No node that was heard boots without an NMT reset.",
    "no_loss": "No frame lost, no line of a log that is none.",
}

rule_options: Final[Decorator] = add_options(
    click.option("--max-load", type=float, metavar="PERCENT", help="Of any second; needs -b."),
    *(
        click.option(f"--{name.replace('_', '-')}", name, is_flag=True, help=text)
        for name, text in _TEXTS.items()
    ),
    click.option(
        "--heartbeat",
        multiple=True,
        metavar="NODE=TIME±OFF",
        help="Its period, as 3=100ms±20% or 3=100ms+-5ms.",
    ),
    click.option("--nodes", multiple=True, metavar="NODES", help="Heard at all, as 3,16-18."),
    click.option(
        "--max-gap", multiple=True, metavar="CAN-ID=TIME", help="Comes again, as 181=20ms."
    ),
    click.option("--known", multiple=True, metavar="CAN-IDS", help="No others, as 080,181-18F."),
)
"""Add a rule each as an option."""


def read_rules(files: Iterable[Path], options: Mapping[str, object]) -> Rules:
    """Return the rules of files and options together.

    Raises:
        Refused: a rule that is none, a file that cannot be read, or no rule at all.
    """
    words: Words = {}
    for path in files:
        words = joined(words, _file(path))
    given = {name: options[name] for name in (*SWITCHES, *VALUES) if options.get(name)}
    if options.get("max_load") is not None:  # 0 is a limit, too
        given["max_load"] = options["max_load"]
    try:
        rules = parse_rules(joined(words, given))
    except ValueError as error:
        raise Refused(str(error)) from None
    if rules == Rules(bit_rate=rules.bit_rate):
        raise Refused("no rule: give --no-emcy, --max-load or others, or a file rules.toml")
    return rules


def _file(path: Path) -> Words:
    """Read a file, and check it alone so that it is named if it is wrong."""
    try:
        words = tomllib.loads(path.read_text("utf-8"))
        parse_rules(words)
    except OSError as error:
        refuse_path("rules", error)
    except ValueError as error:
        raise Refused(f"rules {path}: {error}") from None
    return words
