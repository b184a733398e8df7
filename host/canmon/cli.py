"""The command `canmon`; a verb is imported when it is asked for, so that each starts fast."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Final

import click

from tickrig.host.canmon.unread import until_unread
from tickrig.host.cli.options import version_option

VERBS: Final[dict[str, str]] = {
    "dump": "dump",
    "conv": "conv",
    "info": "info",
    "top": "top",
    "stats": "stats",
    "check": "check",
    "graph": "graph",
    "nodes": "nodes",
    "send": "send",
    "seq": "seq",
    "play": "play",
    "tui": "tui_verb",
}
"""Verbs and the modules under `tickrig.host.canmon` that hold them, each as `command`."""


class LazyGroup(click.Group):
    """A group whose commands live in modules of their own."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in the order in which people meet them."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a verb."""
        if cmd_name not in VERBS:
            return None
        module = import_module(f"tickrig.host.canmon.{VERBS[cmd_name]}")
        command = module.command
        assert isinstance(command, click.Command)
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run a verb; it ends when nobody reads what it prints."""
        with until_unread():
            return super().invoke(ctx)


@click.group(cls=LazyGroup)
@version_option()
def main() -> None:
    """Watch, decode, send, replay and check CAN traffic: a bus, a log file, or standard input.

    \b
    canmon dump can0                              frames, and what they mean
    canmon top run.log                            all identifiers in a table
    canmon nodes can0 --eds 3=drive.eds           all nodes
    canmon check run.log --no-emcy --nodes 3,5    exit status 1 if a rule is broken
    canmon tui can0                               all there is on one screen

    \b
    Completion of verbs and options in the shell:
    eval "$(_CANMON_COMPLETE=bash_source canmon)"
    """  # noqa: D301 - click wants the backspace
