"""The verb `net lss`: node-ID and bit rate over the bus."""

from __future__ import annotations

import re
from typing import Final

import click

from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.lss_work import LssSettings, LssWork
from tickrig.host.canmon.net.session import net_session
from tickrig.host.canopen.commissioning.lss_master import INDICES, SCAN_US, LssMaster
from tickrig.host.cli.options import time_option
from tickrig.host.cli.refused import Refused
from tickrig.wire.canopen.lss import LssAddress

IDENTITY: Final = re.compile(r":".join([r"(?:0x)?([0-9a-f]{1,8})h?"] * 4), re.IGNORECASE)
NODE_IDS: Final = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?")
MOST_DELAY_MS: Final = 65_535
KBIT: Final = {"k": 1_000, "M": 1_000_000}


@click.command()
@click.option("--identity", metavar="V:P:R:S", help="Vendor, product, revision, serial, in hex.")
@click.option("--fastscan", is_flag=True, help="The nodes without a node-ID, one by one.")
@click.option("--only-node", is_flag=True, help="The only node on the bus, whatever it is.")
@click.option("--node-id", "ids", metavar="N|N-M", help="1..127; a range for several.")
@click.option("--bit-rate", metavar="RATE", help="As 500k; counts when activated or at power-on.")
@click.option("--store", is_flag=True, help="Let the node keep both.")
@time_option("--activate", "activate_us", help="Switch the bit rate after a delay, as 200ms.")
@time_option("--wait", "wait_us", help="For answers to each question of a fastscan.  [20ms]")
@click.option("--dry-run", is_flag=True, help="Find and look; configure nothing.")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def command(  # noqa: PLR0913, PLR0917 - options
    call: NetCall,
    identity: str | None,
    fastscan: bool,
    only_node: bool,
    ids: str | None,
    bit_rate: str | None,
    store: bool,
    activate_us: int | None,
    wait_us: int | None,
    dry_run: bool,
    yes: bool,
) -> None:
    """Configure node-ID and bit rate of nodes by LSS (CiA 305).

    Without options it lists the nodes without a node-ID, by fastscan. Which node is
    meant says --identity (1018h, as `scan` shows it), --fastscan, or --only-node. A node
    without a node-ID boots with its new one at once, others with their next reset;
    without --store it is lost with the power. However it ends, all nodes are back in
    LSS waiting.

    \b
    canmon net can0 lss                           who has no node-ID?
    canmon net can0 lss --fastscan --node-id 5 --store
    canmon net can0 lss --fastscan --node-id 10-19 --dry-run
    canmon net can0 lss --identity 0:6210:10000:1 --node-id 7 --bit-rate 500k --store
    """  # noqa: D301 - click wants the backspace
    if sum((identity is not None, fastscan, only_node)) > 1:
        raise Refused("--identity, --fastscan, --only-node: which node? give one")
    settings = LssSettings(
        address=None if identity is None else _address(identity),
        only_node=only_node,
        node_ids=() if ids is None else _node_ids(ids),
        bit_rate=None if bit_rate is None else _bit_rate(bit_rate),
        delay_ms=None if activate_us is None else _delay_ms(activate_us),
        store=store,
        dry_run=dry_run,
    )
    chosen = identity is not None or fastscan or only_node
    if settings.configures and not chosen:
        raise Refused("which node? --identity V:P:R:S, --fastscan, or --only-node")
    if len(settings.node_ids) > 1 and not fastscan:
        raise Refused(f"--node-id {ids} is for several nodes, which only --fastscan finds")
    if settings.delay_ms is not None and settings.bit_rate is None:
        raise Refused("--activate switches to a bit rate: give --bit-rate as well")
    with net_session(call) as session:
        master = LssMaster(session.bus, call.timeout_us, wait_us or SCAN_US)
        LssWork(session, master, settings).run(yes=yes)


def _address(text: str) -> LssAddress:
    match = IDENTITY.fullmatch(text)
    if match is None:
        raise Refused(f"--identity {text!r} is not V:P:R:S in hex, as 0:6210:10000:1")
    return LssAddress(*(int(part, 16) for part in match.groups()))


def _node_ids(text: str) -> tuple[int, ...]:
    match = NODE_IDS.fullmatch(text)
    low = int(match[1]) if match else 0
    high = int(match[2] or low) if match else 0
    if not 1 <= low <= high <= 127:
        raise Refused(f"--node-id {text!r} is no node-ID 1..127, and no range as 10-19")
    return tuple(range(low, high + 1))


def _bit_rate(text: str) -> int:
    number, factor = (text[:-1], KBIT[text[-1]]) if text[-1:] in KBIT else (text, 1)
    rate = int(number) * factor if number.isascii() and number.isdecimal() else 0
    if rate not in INDICES:
        known = ", ".join(f"{each // 1_000}k" for each in sorted(INDICES))
        raise Refused(f"--bit-rate {text!r} is none of CiA 305: {known}")
    return rate


def _delay_ms(delay_us: int) -> int:
    delay_ms = delay_us // 1_000
    if not 1 <= delay_ms <= MOST_DELAY_MS:
        raise Refused(f"--activate: a delay of {delay_ms} ms is not in 1..{MOST_DELAY_MS} ms")
    return delay_ms
