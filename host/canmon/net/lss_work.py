"""What `canmon net lss` does: finds slaves, looks at them, configures them, leaves them waiting."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import click

from tickrig.host.canmon.net.session import NetSession, NodeFailed
from tickrig.host.canopen.commissioning.lss_master import MOST_FOUND, LssFailed, LssMaster
from tickrig.host.canopen.errors import SdoAborted, SdoFailed
from tickrig.host.cli.messages import say
from tickrig.host.cli.refused import Refused
from tickrig.wire.canopen.lss import LssAddress, LssMode
from tickrig.wire.canopen.nmt import NmtState

UNCONFIGURED = 0xFF
BOOT_UP_US = 5_000_000
DEVICE_TYPE = 0x1000


@dataclass(frozen=True, slots=True)
class LssSettings:
    """What the command line says.

    Attributes:
        address: of the slave that is meant; None for those that a fastscan finds.
        only_node: the one slave on the bus is meant.
        node_ids: new node-IDs, for one slave each; empty for none.
        bit_rate: in bit/s, None for none.
        delay_ms: the bit rate is activated with this delay; None: it is not.
        store: both are stored.
        dry_run: nothing is configured.
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
        """Whether something is to be changed."""
        return bool(self.node_ids or self.bit_rate or self.store)

    def steps(self, node_id: int | None) -> list[str]:
        """Return what is done to one slave."""
        steps = [] if node_id is None else [f"node-ID {node_id}"]
        if self.bit_rate is not None:
            steps.append(f"bit rate {self.bit_rate // 1_000}k")
        if self.store:
            steps.append("store")
        if self.delay_ms is not None:
            steps.append(f"activate the bit rate in {self.delay_ms} ms")
        return steps


class LssWork:
    """One call.

    Args:
        session: the bus.
        master: speaks LSS there.
        settings: what is to be done.
    """

    def __init__(self, session: NetSession, master: LssMaster, settings: LssSettings) -> None:
        self._session, self._master, self._settings = session, master, settings

    def run(self, *, yes: bool) -> None:
        """Do it.

        Raises:
            Refused: a node-ID is taken, or the answer was no.
            NodeFailed: a slave refused, or there is none.
        """
        settings = self._settings
        for node_id in settings.node_ids:
            self._check_free(node_id)
        if settings.configures and not settings.dry_run:
            self._consent(yes=yes)
        try:
            with self._master.at_work():
                found = self._configure_all()
        except LssFailed as error:
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
        """Refuse a node-ID that somebody has."""
        try:
            self._session.bus.read(node_id, DEVICE_TYPE, 0)
        except SdoAborted:
            pass
        except SdoFailed:
            return
        raise Refused(f"node-ID {node_id} is taken: a node answers there")

    def _configure_all(self) -> int:
        """Configure one slave after the other; return how many there were."""
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
        """Show who was found; NodeFailed if several were, and are to be configured."""
        count = self._master.count()
        shared = f", {count} nodes with this identity" if count > 1 else ""
        click.echo(f"{_text(address)}  {_id_text(old_id)}{shared}")
        if shared and self._settings.configures:
            raise NodeFailed(
                f"{count} nodes have the identity {_text(address)}: LSS cannot tell them apart,"
                " so they were not configured; connect one after the other"
            )

    def _slaves(self) -> Iterator[tuple[LssAddress, int]]:
        """Yield each slave that is meant, in configuration, with its node-ID."""
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
        """Yield what fastscans find: who was found is in configuration, and answers no more."""
        seen = set[LssAddress]()
        most = len(self._settings.node_ids) or MOST_FOUND
        while len(seen) < most and (address := self._master.fastscan()) is not None:
            if address in seen:
                say(f"{_text(address)} answers a fastscan twice; the search ends here")
                return
            seen.add(address)
            yield address, UNCONFIGURED

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
        """Have a slave without a node-ID boot with its new one; say when that of another counts."""
        if old_id != UNCONFIGURED:
            say(f"node-ID {node_id} counts from its next reset: nmt reset-node {old_id}")
            return
        bus = self._session.bus
        bus.states.pop(node_id, None)
        self._master.switch_all(LssMode.WAITING)
        wanted = (NmtState.INITIALISING,)
        if node_id not in bus.states and bus.await_state(node_id, wanted, BOOT_UP_US) is None:
            raise NodeFailed(f"node {node_id}: no boot-up within {BOOT_UP_US // 1_000_000} s")

    def _nobody(self) -> str:
        settings = self._settings
        if settings.address is not None:
            return f"no node with the identity {_text(settings.address)} answers"
        return "no node without a node-ID answers a fastscan"


def _text(address: LssAddress) -> str:
    return ":".join(f"{part:08X}" for part in address)


def _id_text(node_id: int) -> str:
    return "no node-ID" if node_id == UNCONFIGURED else f"node-ID {node_id}"
