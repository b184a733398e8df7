"""The verb `eds`: EDS files, and what is done with them."""

from __future__ import annotations

from typing import Final

import click

from tickrig.host.cli.options import LazyGroup

_HERE: Final = "tickrig.host.canmon.eds"
_VERBS: Final = {
    "check": (f"{_HERE}.check_verb:command", "Tell all that is wrong in EDS files."),
    "fix": (f"{_HERE}.fix_verb:command", "Mend an EDS."),
    "diff": (f"{_HERE}.show_verb:compare", "Compare the devices of two EDS files."),
    "show": (f"{_HERE}.show_verb:show", "Show the device of an EDS."),
}


@click.group(cls=LazyGroup, commands=_VERBS)
def command() -> None:
    """Check, mend, compare and show EDS files: EDS, DCF, XDD, XDC.

    \b
    canmon eds check drive.eds                    all findings, with line, clause and fix
    canmon eds fix drive.eds -o mended.eds        what needs no knowledge of the device
    canmon eds diff old.eds new.xdd               what is another device
    canmon eds show drive.eds 6040                an object; without it, all of them
    """  # noqa: D301 - click wants the backspace
