"""Hosts that look at a clock, on a bench."""

from __future__ import annotations

import time
from typing import Any

import pytest

from tests.emulators.testing.host_clock.user_host import Host
from tickrig import Bench
from tickrig.device import Rrc, make_f_palette


def test_a_pyserial_host_with_a_deadline_of_its_own() -> None:
    with Bench(Rrc()) as bench, bench.patched_time():
        host = Host(bench.serial(timeout=0))
        time.sleep(0.1)
        assert host.poll() == "EV:Initialized"
        assert host.ask("device") == "OK:device"
        time.sleep(0.01)
        assert host.poll() == "RRC"
        bench.set("rrc_power", 0)
        begin_us = bench.now_us
        with pytest.raises(TimeoutError):
            host.ask("device", 5.0)
        assert 0 <= bench.now_us - begin_us - 5_000_000 < 3_000


def test_a_host_that_watches_in_waiting() -> None:
    with Bench(Rrc()) as bench, bench.patched_time():
        port: Any = bench.serial(timeout=0)
        while not port.in_waiting:
            time.sleep(0.001)
        assert port.read(4) != b""


def test_a_network_calls_back_while_its_host_sleeps() -> None:
    with Bench(make_f_palette(1)) as bench, bench.patched_time() as clock:
        seen: list[bytes] = []
        network = bench.canopen_network()
        network.subscribe(0x701, lambda can_id, data, stamp: seen.append(bytes(data)))
        time.sleep(1)
        assert seen[0] == bytes(1)
        network.disconnect()
        time.sleep(1)
        clock.sleep(1)
        assert 3_000_000 <= bench.now_us < 3_001_000


@pytest.mark.realtime
def test_in_real_time_nothing_is_patched() -> None:
    sleep = time.sleep
    with Bench(Rrc(), mode="real") as bench, bench.patched_time() as clock:
        assert time.sleep is sleep
        assert clock.sleep is sleep
