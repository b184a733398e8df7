"""The verb `net lss`, which sets node-ID and bit rate over the bus."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import click

from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import NetSession, NodeFailed, net_session
from tickrig.host.canopen.commissioning import lss_master
from tickrig.host.canopen.errors import SdoAborted, SdoFailed
from tickrig.host.cli.messages import Refused, say
from tickrig.host.cli.options import time_option
from tickrig.wire.canopen.lss import LssAddress, LssMode
from tickrig.wire.canopen.nmt import NmtState

# The work of `canmon net lss`: find, inspect and configure slaves, and leave them waiting.

_UNCONFIGURED = 0xFF
_BOOT_UP_US = 5_000_000
_DEVICE_TYPE = 0x1000


@dataclass(frozen=True, slots=True)
class LssSettings:
    """The options of the command `canmon net lss`.

    Attributes:
        address: LSS address of the slave, or None for slaves found by fastscan.
        only_node: whether the command addresses the only slave on the bus, without an LSS address.
        node_ids: new node-IDs, one for each slave, or empty to keep the node-IDs.
        bit_rate: new bit rate in bit/s, or None to keep the bit rate.
        delay_ms: delay in milliseconds before the slaves switch to the new bit rate. With None,
            they do not switch.
        store: whether the slaves store their node-ID and bit rate.
        dry_run: whether the command only shows what it would do, and does not change the slaves.
    """

    address: LssAddress | None = None
    only_node: bool = False
    node_ids: tuple[int, ...] = ()
    bit_rate: int | None = None
    delay_ms: int | None = None
    store: bool = False
    dry_run: bool = False

    @property
    def configures(self) -> bool:
        """Whether the settings change a slave."""
        return bool(self.node_ids or self.bit_rate or self.store)

    def steps(self, node_id: int | None) -> list[str]:
        """Return the steps for one slave."""
        steps = [] if node_id is None else [f"node-ID {node_id}"]
        if self.bit_rate is not None:
            steps.append(f"bit rate {self.bit_rate // 1_000}k")
        if self.store:
            steps.append("store")
        if self.delay_ms is not None:
            steps.append(f"activate the bit rate in {self.delay_ms} ms")
        return steps


_MOST_FOUND: Final = 127


class LssWork:
    """Execution of one `canmon net lss` command: find LSS slaves, then configure them.

    Args:
        session: session of the command with the open bus.
        master: LSS master on the bus.
        settings: options of the command.
    """

    def __init__(
        self, session: NetSession, master: lss_master.LssMaster, settings: LssSettings
    ) -> None:
        self._session, self._master, self._settings = session, master, settings

    def run(self, *, yes: bool) -> None:
        """Execute the command. `yes` skips the question to the user.

        Raises:
            Refused: a node-ID is in use, or the user declined.
            NodeFailed: a slave refused a command, or no slave was found.
        """
        settings = self._settings
        for node_id in settings.node_ids:
            self._check_free(node_id)
        if settings.configures and not settings.dry_run:
            self._consent(yes=yes)
        try:
            with self._master.at_work():
                found = self._configure_all()
        except lss_master.LssFailed as error:
            raise NodeFailed(str(error)) from None
        finally:
            if self._master.waiting:
                self._session.work.ending = "all nodes were sent back to LSS waiting"
        if not found:
            raise NodeFailed(self._nobody())

    def _consent(self, *, yes: bool) -> None:
        settings = self._settings
        ids = settings.node_ids
        steps = settings.steps(ids[0] if len(ids) == 1 else None)
        if len(ids) > 1:
            steps.insert(0, f"node-IDs {ids[0]} to {ids[-1]}")
        risk = ""
        if settings.delay_ms is not None:
            risk = "Who stays at the old bit rate disturbs the bus: set your adapter too"
        who = _text(settings.address) if settings.address else "nodes without a node-ID"
        who = "the only node" if settings.only_node else who
        self._session.confirm(f"LSS: {', '.join(steps)} for {who}", yes=yes, risk=risk)

    def _check_free(self, node_id: int) -> None:
        """Raise Refused if a node-ID is in use."""
        try:
            self._session.bus.read(node_id, _DEVICE_TYPE, 0)
        except SdoAborted:
            pass
        except SdoFailed:
            return
        raise Refused(f"node-ID {node_id} is taken: a node answers there")

    def _configure_all(self) -> int:
        """Configure one slave after the other. Return the number of slaves."""
        ids = iter(self._settings.node_ids)
        found = 0
        for address, old_id in self._slaves():
            found += 1
            self._show_slave(address, old_id)
            node_id = next(ids, None)
            if self._settings.configures:
                self._configure(node_id, old_id)
        return found

    def _show_slave(self, address: LssAddress, old_id: int) -> None:
        """Show the found slave.

        Raise NodeFailed if several slaves with its identity would be configured.
        """
        count = self._master.count()
        shared = f", {count} nodes with this identity" if count > 1 else ""
        click.echo(f"{_text(address)}  {_id_text(old_id)}{shared}")
        if shared and self._settings.configures:
            raise NodeFailed(
                f"{count} nodes have the identity {_text(address)}: LSS cannot tell them apart,"
                " so they were not configured; connect one after the other"
            )

    def _slaves(self) -> Iterator[tuple[LssAddress, int]]:
        """Yield each slave to configure, in state configuration, with its node-ID."""
        master, settings = self._master, self._settings
        if settings.only_node:
            master.switch_all(LssMode.CONFIGURATION)
            yield master.address(), master.node_id()
        elif settings.address is not None:
            if master.select(settings.address):
                yield settings.address, master.node_id()
        else:
            yield from self._scanned()

    def _scanned(self) -> Iterator[tuple[LssAddress, int]]:
        """Yield the results of fastscans. A found slave is in configuration and stays silent."""
        seen = set[LssAddress]()
        most = len(self._settings.node_ids) or _MOST_FOUND
        while len(seen) < most and (address := self._master.fastscan()) is not None:
            if address in seen:
                say(f"{_text(address)} answers a fastscan twice; the search ends here")
                return
            seen.add(address)
            yield address, _UNCONFIGURED

    def _configure(self, node_id: int | None, old_id: int) -> None:
        settings, master, work = self._settings, self._master, self._session.work
        steps = settings.steps(node_id)
        if settings.dry_run:
            say(f"dry run, not done: {', '.join(steps)}")
            return
        work.plan(*steps)
        if node_id is not None:
            master.configure_node_id(node_id)
            work.done()
        if settings.bit_rate is not None:
            master.configure_bit_rate(settings.bit_rate)
            work.done()
        if settings.store:
            master.store()
            work.done()
        if settings.delay_ms is not None:
            master.activate_bit_rate(settings.delay_ms)
            work.done()
        elif node_id is not None:
            self._see_boot(node_id, old_id)
        say(f"done: {', '.join(steps)}")

    def _see_boot(self, node_id: int, old_id: int) -> None:
        """Boot a slave that had no node-ID with its new one.

        For other slaves, report when it takes effect.
        """
        if old_id != _UNCONFIGURED:
            say(f"node-ID {node_id} counts from its next reset: nmt reset-node {old_id}")
            return
        bus = self._session.bus
        bus.states.pop(node_id, None)
        self._master.switch_all(LssMode.WAITING)
        wanted = (NmtState.INITIALISING,)
        if node_id not in bus.states and bus.await_state(node_id, wanted, _BOOT_UP_US) is None:
            raise NodeFailed(f"node {node_id}: no boot-up within {_BOOT_UP_US // 1_000_000} s")

    def _nobody(self) -> str:
        settings = self._settings
        if settings.address is not None:
            return f"no node with the identity {_text(settings.address)} answers"
        return "no node without a node-ID answers a fastscan"


def _text(address: LssAddress) -> str:
    return ":".join(f"{part:08X}" for part in address)


def _id_text(node_id: int) -> str:
    return "no node-ID" if node_id == _UNCONFIGURED else f"node-ID {node_id}"


_IDENTITY: Final = re.compile(r":".join([r"(?:0x)?([0-9a-f]{1,8})h?"] * 4), re.IGNORECASE)
_NODE_IDS: Final = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?")
_MOST_DELAY_MS: Final = 65_535
_KBIT: Final = {"k": 1_000, "M": 1_000_000}


@click.command()
@click.option(
    "--identity",
    metavar="V:P:R:S",
    help="Select by vendor, product, revision and serial (hex).",
)
@click.option("--fastscan", is_flag=True, help="Select the nodes without a node-ID, one by one.")
@click.option("--only-node", is_flag=True, help="Select the only node on the bus, of any identity.")
@click.option(
    "--node-id", "ids", metavar="N|N-M", help="New node-ID, 1 to 127, or a range for several nodes."
)
@click.option(
    "--bit-rate",
    metavar="RATE",
    help="New bit rate, such as 500k, used after --activate or power-on.",
)
@click.option("--store", is_flag=True, help="Store node-ID and bit rate in the node.")
@time_option("--activate", "activate_us", help="Switch the bit rate after a delay, such as 200ms.")
@time_option("--wait", "wait_us", help="Time-out of each request of a fastscan. [20ms]")
@click.option("--dry-run", is_flag=True, help="Find nodes without configuring them.")
@click.option("--yes", is_flag=True, help="Do not ask for confirmation.")
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

    Without options, the command lists the nodes without a node-ID, by fastscan. Select the node by
    --identity (1018h, as shown by `scan`), --fastscan, or --only-node. A node without a node-ID
    boots with its new node-ID at once. Other nodes use it after their next reset. Without --store,
    the new node-ID is lost at power-off. In any case, all nodes are back in LSS waiting at the end.

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
        master = lss_master.LssMaster(session.bus, call.timeout_us, wait_us or lss_master.SCAN_US)
        LssWork(session, master, settings).run(yes=yes)


def _address(text: str) -> LssAddress:
    match = _IDENTITY.fullmatch(text)
    if match is None:
        raise Refused(f"--identity {text!r} is not V:P:R:S in hex, as 0:6210:10000:1")
    return LssAddress(*(int(part, 16) for part in match.groups()))


def _node_ids(text: str) -> tuple[int, ...]:
    match = _NODE_IDS.fullmatch(text)
    low = int(match[1]) if match else 0
    high = int(match[2] or low) if match else 0
    if not 1 <= low <= high <= 127:
        raise Refused(f"--node-id {text!r} is no node-ID 1..127, and no range as 10-19")
    return tuple(range(low, high + 1))


def _bit_rate(text: str) -> int:
    number, factor = (text[:-1], _KBIT[text[-1]]) if text[-1:] in _KBIT else (text, 1)
    rate = int(number) * factor if number.isascii() and number.isdecimal() else 0
    if rate not in lss_master.INDICES:
        known = ", ".join(f"{each // 1_000}k" for each in sorted(lss_master.INDICES))
        raise Refused(f"--bit-rate {text!r} is not a bit rate of CiA 305: {known}")
    return rate


def _delay_ms(delay_us: int) -> int:
    delay_ms = delay_us // 1_000
    if not 1 <= delay_ms <= _MOST_DELAY_MS:
        raise Refused(f"--activate: a delay of {delay_ms} ms is not in 1..{_MOST_DELAY_MS} ms")
    return delay_ms
