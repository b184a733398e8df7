"""LSS: our master and that of the canopen library, against our slave and durand's."""

from __future__ import annotations

from collections import deque
from typing import Any

import pytest
from durand.network import NetworkABC

from tests.emulators.testing.conformance.stacks import _durand_node
from tests.host.canopen.commissioning.net_bench import NetBench
from tickrig.device import make_epos, make_f_palette
from tickrig.device.canopen.slave import CanopenSlave, Nonvolatile
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.testing.conformance.durand_slave import DurandSlave
from tickrig.emulators.testing.conformance.slave import Slave
from tickrig.host.canopen.commissioning.lss_master import LssFailed, LssMaster
from tickrig.wire.can import Frames
from tickrig.wire.canopen.lss import LssAddress, LssMode
from tickrig.wire.instant import NEVER

R1 = LssAddress(0xAB01, 2, 0x3_0004, 0x5678)
EPOS = LssAddress(0, 0x6210, 0x10000, 1)
NOBODY = LssAddress(1, 2, 3, 4)
BOOT_UP_US = 500_000


def durand(stored: list[int]) -> DurandSlave:
    """Make a node of durand that waits for LSS, and keeps what it is told to store."""

    def make(network: NetworkABC) -> Any:
        node = _durand_node(network, stored[-1])
        node.lss.set_store_configuration_callback(lambda rate, node_id: stored.append(node_id))
        node.lss.set_baudrate_change_callback(lambda rate, delay: None)
        return node

    return DurandSlave(make)


def ours(memory: Nonvolatile | None = None) -> CanopenSlave:
    return make_epos(255, nonvolatile=memory)


SLAVES = [(ours, EPOS), (lambda: durand([255]), R1)]
both = pytest.mark.parametrize(("make", "address"), SLAVES, ids=["ours", "durand"])


@both
def test_a_fastscan_finds_the_address(make: Any, address: LssAddress) -> None:
    bench = NetBench(make())
    master = LssMaster(bench.bus)
    with master.at_work():
        assert master.fastscan() == address
        assert (master.address(), master.node_id()) == (address, 255)
    assert master.waiting


@both
def test_the_master_of_the_canopen_library_finds_the_same(make: Any, address: LssAddress) -> None:
    bench = NetBench(make())
    network = SimNetwork(bench.rig, bench.wire.end())
    lss: Any = network.lss
    assert lss.fast_scan() == (True, list(address))


@both
def test_a_slave_gets_its_node_id_and_boots(make: Any, address: LssAddress) -> None:
    bench = NetBench(make())
    master = LssMaster(bench.bus)
    with master.at_work():
        assert master.select(address)
        master.configure_node_id(7)
        master.configure_bit_rate(500_000)
        with pytest.raises(LssFailed, match="configure node-ID: node-ID out of range"):
            master.configure_node_id(200)
    bench.bus.gather(BOOT_UP_US)
    assert "707#00" in bench.frames
    assert len(bench.bus.read(7, 0x1000, 0)) == 4


@both
def test_both_masters_say_the_same(make: Any, address: LssAddress) -> None:
    def frames(bench: NetBench) -> list[str]:
        return [text for text in bench.frames if text.startswith("7E")]

    bench, other = NetBench(make()), NetBench(make())
    master = LssMaster(bench.bus)
    assert master.select(address)
    master.configure_node_id(7)
    assert master.address() == address
    assert master.node_id() == 255
    master.switch_all(LssMode.WAITING)
    lss: Any = SimNetwork(other.rig, other.wire.end()).lss
    assert lss.send_switch_state_selective(*address)
    lss.configure_node_id(7)
    assert [lss.inquire_lss_address(command) for command in range(0x5A, 0x5E)] == list(address)
    assert lss.inquire_node_id() == 255
    lss.send_switch_state_global(lss.WAITING_STATE)
    other.rig.run_for(BOOT_UP_US)
    assert frames(bench) == frames(other)


def test_what_was_stored_is_there_after_the_power_was_cut() -> None:
    memory, stored = Nonvolatile(), [255]
    for slave, address in ((ours(memory), EPOS), (durand(stored), R1)):
        bench = NetBench(slave)
        master = LssMaster(bench.bus)
        with master.at_work():
            assert master.select(address)
            master.configure_node_id(9)
            master.store()
    assert memory.node_id == 9
    assert stored == [255, 9]


def test_a_bit_rate_is_activated_after_its_delay() -> None:
    slave, rates = ours(), list[int]()
    slave.on_bit_rate.append(rates.append)
    bench = NetBench(slave)
    master = LssMaster(bench.bus)
    assert master.select(EPOS)
    master.configure_bit_rate(250_000)
    master.activate_bit_rate(100)
    bench.bus.gather(50_000)
    assert rates == []
    bench.bus.gather(100_000)
    assert rates == [250_000]


def test_slaves_are_found_one_after_the_other() -> None:
    slaves: tuple[Slave, ...] = (ours(), make_f_palette(255), make_f_palette(16))
    bench = NetBench(*slaves)
    master = LssMaster(bench.bus)
    with master.at_work():
        found = [master.fastscan() for _ in range(3)]
    assert found == [LssAddress(0, 1, 0x10000, 1), EPOS, None]


def test_nobody_is_found_where_nobody_is() -> None:
    bench = NetBench(make_epos(5))
    master = LssMaster(bench.bus)
    assert master.fastscan() is None
    assert not master.select(NOBODY)
    with pytest.raises(LssFailed, match="store: no answer within 500 ms"):
        master.store()


def test_two_slaves_are_not_configured_as_one() -> None:
    bench = NetBench(ours(), make_f_palette(16))
    master = LssMaster(bench.bus)
    with master.at_work():
        master.switch_all(LssMode.CONFIGURATION)
        with pytest.raises(LssFailed, match="2 slaves answered, where one may"):
            master.address()


def test_answers_that_fit_no_address_are_told() -> None:
    bench = NetBench(ours())
    bench.wire.faults.arm("drop", "0.1")
    with pytest.raises(LssFailed, match="not confirmed; a slave is gone, or needs longer"):
        LssMaster(bench.bus).fastscan()


def test_a_slave_that_answers_late_gets_more_time() -> None:
    bench = NetBench(Late(ours()))
    assert LssMaster(bench.bus, scan_us=10_000).fastscan() == EPOS


def test_slaves_with_the_same_address_are_counted() -> None:
    bench = NetBench(ours(), Late(ours(), 2_000))
    master = LssMaster(bench.bus)
    with master.at_work():
        assert master.count() == 0
        assert master.fastscan() == EPOS
        assert master.count() == 2


class Late:
    """A slave that says what it has to say some time later.

    Args:
        slave: the slave.
        late_us: by how much.
    """

    def __init__(self, slave: CanopenSlave, late_us: int = 15_000) -> None:
        self._slave, self._late_us = slave, late_us
        self._waiting = deque[tuple[int, Frames]]()

    tick_us = 1_000

    @property
    def due_us(self) -> int:
        return min(self._slave.due_us, *(due_us for due_us, _ in self._waiting), NEVER)

    def reset(self) -> None:
        self._slave.reset()

    def tick(self, now_us: int, rx: Frames, /) -> Frames:
        if out := self._slave.tick(now_us, rx):
            self._waiting.append((now_us + self._late_us, out))
        if self._waiting and self._waiting[0][0] <= now_us:
            return self._waiting.popleft()[1]
        return ()
