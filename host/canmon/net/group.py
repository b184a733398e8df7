"""The verb group `net`, which sets up a CANopen network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import click

from tickrig.host.cli.can_options import BusOptions, bus_options, spread
from tickrig.host.cli.options import LazyGroup, time_option

_HERE: Final = "tickrig.host.canmon.net"
VERBS: Final = {
    "scan": (f"{_HERE}.node_verbs:scan", "List the nodes on the bus."),
    "nmt": (f"{_HERE}.node_verbs:nmt", "Send an NMT command to NODE, or to all."),
    "lss": (
        f"{_HERE}.lss_verb:command",
        "Configure node-ID and bit rate of nodes by LSS (CiA 305).",
    ),
    "read": (f"{_HERE}.object_verbs:read", "Read objects of NODE."),
    "write": (f"{_HERE}.object_verbs:write", "Write objects of NODE."),
    "dcf": (f"{_HERE}.object_verbs:dcf", "Write the configuration of the DCF or XDC FILE to NODE."),
    "compare": (f"{_HERE}.object_verbs:compare", "Compare NODE with a DCF, or with another node."),
    "store": (f"{_HERE}.object_verbs:store", "Store parameters of NODE (1010h)."),
    "restore": (f"{_HERE}.object_verbs:restore", "Restore the defaults of NODE (1011h)."),
    "program": (f"{_HERE}.program_verb:command", "Download FILE to NODE by block transfer."),
    "boot": (f"{_HERE}.node_verbs:boot", "Boot NODE like an NMT master (CiA 302-2)."),
}
_ANSWER_US: Final = 500_000


@dataclass(frozen=True, slots=True)
class NetCall:
    """The options of `canmon net` that stand before the name of the subcommand.

    Attributes:
        word: SOURCE word that names the bus, or None if the options name it.
        bus: options of the bus.
        timeout_us: time to wait for an answer in microseconds.
    """

    word: str | None
    bus: BusOptions
    timeout_us: int


class _NetGroup(LazyGroup):
    """A group with SOURCE before its verbs, unless options name the bus."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert an empty SOURCE if the first argument is a verb."""
        args = spread(args)
        found, rest, _ = self.make_parser(ctx).parse_args(list(args))
        if found.get("source") in self.commands:
            args.insert(len(args) - len(rest) - 1, "")
        return super().parse_args(ctx, args)


@click.group(cls=_NetGroup, commands=VERBS, subcommand_metavar="VERB [ARGS]...")
@click.argument("source", required=False)
@time_option("--timeout", "timeout_us", help="Time-out of a node's answer. [500ms]")
@bus_options
@click.pass_context
def command(
    context: click.Context, /, source: str | None, timeout_us: int | None, **options: Any
) -> None:
    """Set up a CANopen network: find, address, configure and program its nodes.

    SOURCE is a bus, or a rig file in virtual time. Instead of SOURCE, -i and -c may name interface
    and channel of a bus, as in python-can. Verbs that write ask first, or need --yes. They warn if
    a motor may turn. In a rig, they do not ask.

    \b
    canmon net can0 scan                          which nodes are there?
    canmon net can0 scan --write bus.yml --eds-dir eds
    canmon net can0 read 5 device_name 1018h:1    objects by name or index
    canmon net can0 write 5 heartbeat_time=100
    canmon net can0 nmt start 5
    canmon net can0 lss --fastscan --node-id 5 --store
    canmon net can0 dcf 5 drive.dcf --dry-run     what would be written; writes nothing
    canmon net can0 program 5 firmware.bin
    canmon net can0 boot 5 --bus bus.yml --explain        what it would write

    \b
    Exit status  0 all is done            2 usage
                 1 a node refused, did    3 the bus or a file failed
                   not answer, or differs
    """  # noqa: D301 - click wants the backspace
    context.obj = NetCall(source or None, BusOptions(**options), timeout_us or _ANSWER_US)
