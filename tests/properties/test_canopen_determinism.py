"""A network of 127 slaves gives the same log, whatever must not matter."""

from __future__ import annotations

import hashlib
import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from tests.device.canopen.reference import make_dictionary
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame

ROOT = Path(__file__).parents[2]
NODES = 127
MASTER = [
    (50_000, ["000#0100"]),
    (60_000, [f"{0x600 + n:03X}#2B1710001E000000" for n in range(1, NODES + 1)]),
    (150_000, ["080#", "201#1234", "27F#5678"]),
    (180_000, [f"{0x600 + n:03X}#4008100000000000" for n in range(1, NODES + 1, 3)]),
    (220_000, ["000#8100", "080#"]),
]
END_US = 400_000


def network(*, order: int = 0, dense: bool = False) -> str:
    """Run the network; return a digest of all that was on the bus."""
    numbers = list(range(1, NODES + 1))
    if order:
        random.Random(order).shuffle(numbers)
    wire, log = CanWire(), list[str]()
    wire.observers.append(lambda at_us, heard: log.append(f"{at_us} {heard}"))
    slaves = {n: make_slave(make_dictionary(()), n) for n in sorted(numbers)}
    rig = Rig(*(Station(slaves[n], wire.end()) for n in numbers), dense=dense)
    master = wire.end(accepts=frozenset())
    for at_us, frames in MASTER:
        rig.run_to(at_us)
        master.send(at_us, tuple(CanFrame.parse(text) for text in frames))
    rig.run_to(END_US)
    assert len(log) > 5 * NODES
    return hashlib.sha256("\n".join(log).encode()).hexdigest()


@pytest.fixture(scope="module")
def once() -> str:
    return network()


def test_the_order_of_127_nodes_makes_no_difference(once: str) -> None:
    assert network(order=7) == once


def test_dense_and_sparse_runs_are_the_same(once: str) -> None:
    assert network(dense=True) == once


@pytest.mark.parametrize("seed", ["0", "1"])
def test_another_process_and_hash_seed_make_no_difference(once: str, seed: str) -> None:
    program = "from tests.properties.test_canopen_determinism import network; print(network())"
    path = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == once
