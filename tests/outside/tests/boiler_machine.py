"""The boiler room with anything that may happen to it: what its hosts must keep."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from boiler.kettle import KettleError, KettleHost
from boiler.master import Master, SdoError

from tickrig import Bench, open_bench
from tickrig.testing import BenchMachine, host_rule, invariant

RIG = Path(__file__).parents[1] / "rigs" / "boiler.toml"
BACK_US = 2_000_000


class Boiler(BenchMachine):
    """Faults of the wires and of the motor, while its hosts are asked for what they can."""

    faults = ("kettle/cut", "stirrer/power_off", "stirrer/encoder_unplugged")
    inputs = ()
    fault_for = ("1s", "3s")
    patience = "12s"
    longest = "200s"

    def make_bench(self) -> Bench:
        return open_bench(RIG)

    def connect(self) -> None:
        self.kettle = KettleHost(self.bench["kettle"].serial())
        self.bus = self.bench["stirrer"].can_bus()
        self.master = Master(self.bus, on_failure=self.stop_heating)
        self.names: set[bytes] = set()
        self.failures = self.bench["stirrer"].on_line("085#0573*")
        self.known, self.deaf = 0, False

    def disconnect(self) -> None:
        self.bus.shutdown()

    def stop_heating(self) -> None:
        try:
            self.kettle.stop()
        except KettleError:
            self.deaf = True

    def heat(self) -> None:
        self.known, self.deaf = self.failures.count, False
        self.ask(self.kettle.heat)

    @host_rule()
    def heat_and_turn(self) -> None:
        self.heat()
        with suppress(SdoError):
            self.master.start()
            self.master.write(0x6411, 1, 9_000, 2)
            self.master.write(0x2000, 0, 2, 1)

    @host_rule()
    def read_name_amid_duplicates(self) -> None:
        self.bench.fault("can/duplicate=0.05")
        for _ in range(10):
            with suppress(SdoError):
                self.names.add(self.master.read(0x1008))
        self.bench.clear("can/duplicate")
        for _ in range(30):
            self.master.turn()

    @host_rule()
    def lose_a_boot_up(self) -> None:
        self.bench.fault("can/drop=1", for_="300ms")
        self.bench["stirrer"].fault("power_off", for_="100ms")
        self.bench.run_for("400ms")
        self.master.boots = 0

    @host_rule()
    def watch(self) -> None:
        for _ in range(80):
            self.ask(self.master.watch)
        heats = self.bench["kettle"].get("state") == "Heating"
        failed = self.failures.count > self.known
        assert not (heats and failed) or self.deaf, "it heats although the motor has failed"

    def ask(self, what: Callable[[], object]) -> None:
        with suppress(KettleError):
            what()

    @invariant()
    def a_name_is_a_name(self) -> None:
        assert len(self.names) < 2, f"one motor has the names {self.names}"

    def end(self) -> None:
        """When all is well again, the motor is set to work, and is heard."""
        self.calm()
        self.bench.run_for("1s")
        for _ in range(3):  # an answer of before may be on its way still
            with suppress(SdoError):
                self.master.start()
        self.master.angle = None
        until_us = self.bench.now_us + BACK_US
        while self.master.angle is None and self.bench.now_us < until_us:
            self.master.watch()
        assert self.master.angle is not None, "nothing is heard of the angle"
