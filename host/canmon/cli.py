"""The command `canmon`."""

from __future__ import annotations

from typing import Any, Final

import click

from tickrig.host.cli.messages import until_unread
from tickrig.host.cli.options import LazyGroup, version_option

_HERE: Final = "tickrig.host.canmon.verbs"
_VERBS: Final = {
    "dump": (f"{_HERE}.dump:dump", "Show frames as they come, and what they mean."),
    "conv": (f"{_HERE}.dump:conv", "Write the content of SOURCE into the file LOG."),
    "info": (f"{_HERE}.info:command", "Show what log files hold."),
    "top": (f"{_HERE}.top:command", "Show all identifiers: counts, rates, gaps, jitter."),
    "stats": (f"{_HERE}.stats:command", "Count a log: rates, gaps, jitter, missed cycles."),
    "check": (f"{_HERE}.check:command", "Report what is wrong on a bus or in a log."),
    "report": (
        f"{_HERE}.report:command",
        "Write the traffic of a bus as one self-contained HTML page.",
    ),
    "conform": (f"{_HERE}.conform:command", "Test one CANopen node, clause by clause."),
    "eds": ("tickrig.host.canmon.cli:eds", "Check, fix, compare and show EDS files."),
    "net": ("tickrig.host.canmon.net.group:command", "Set up a CANopen network."),
    "gateway": (
        "tickrig.host.canmon.gateway:command",
        "Serve SOURCE to other programs in lines of text: CiA 309-3, ASCII mapping.",
    ),
    "graph": (f"{_HERE}.graph:command", "Draw curves of SOURCE: in the terminal, or to files."),
    "nodes": (f"{_HERE}.nodes:command", "Show all nodes: NMT state, heartbeat, boot-ups."),
    "send": (f"{_HERE}.send:command", "Send frames on BUS."),
    "seq": (f"{_HERE}.seq:command", "Run the sequence FILE on BUS."),
    "play": (f"{_HERE}.play:command", "Send the frames of LOG again."),
    "tui": (f"{_HERE}.tui_verb:command", "Show all there is in tabs."),
}


class _Verbs(LazyGroup):
    """The command group with the verbs of canmon."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a verb. The verb ends when no program reads its output any more."""
        with until_unread():
            return super().invoke(ctx)


@click.group(cls=_Verbs, commands=_VERBS)
@version_option()
def main() -> None:
    """Watch, decode, send, replay and check CAN traffic of a bus, a log file or standard input.

    \b
    canmon dump can0                              frames, and what they mean
    canmon top run.log                            all identifiers in a table
    canmon nodes can0 --eds 3=drive.eds           all nodes
    canmon check run.log --no-emcy --nodes 3,5    exit status 1 if a rule is broken
    canmon report run.log -o run.html             one page that you can mail
    canmon conform can0 --node 5 --eds drive.eds  is this a CANopen node?
    canmon net can0 scan                          find, address, configure, program nodes
    canmon tui can0                               all there is on one screen

    \b
    Completion of verbs and options in the shell:
    eval "$(_CANMON_COMPLETE=bash_source canmon)"
    """  # noqa: D301 - click wants the backspace


_EDS: Final = "tickrig.host.canmon.eds_verbs"
_EDS_VERBS: Final = {
    "check": (f"{_EDS}:check_all", "Check EDS files and print all findings."),
    "fix": (f"{_EDS}:mend", "Fix an EDS."),
    "diff": (f"{_EDS}:compare", "Compare the devices of two EDS files."),
    "show": (f"{_EDS}:show", "Show the device of an EDS."),
}


@click.group(cls=LazyGroup, commands=_EDS_VERBS)
def eds() -> None:
    """Check, fix, compare and show EDS files: EDS, DCF, XDD, XDC.

    \b
    canmon eds check drive.eds                    print findings, with line, clause and fix
    canmon eds fix drive.eds -o fixed.eds         fix errors that need no knowledge of the device
    canmon eds diff old.eds new.xdd               print the differences of the devices
    canmon eds show drive.eds 6040                print object 6040h; without 6040, all objects
    """  # noqa: D301 - click wants the backspace
