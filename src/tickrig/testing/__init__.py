"""Tests for your own devices. The package needs the extra `test` (pytest and Hypothesis)."""

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.emulators.testing.conformance.conformance import conformance as conformance
    from tickrig.emulators.testing.conformance.conformance import (
        conformance_text as conformance_text,
    )
    from tickrig.emulators.testing.conformance.conformance import (
        write_conformance as write_conformance,
    )
    from tickrig.emulators.testing.conformance.pytest_suite import (
        conformance_tests as conformance_tests,
    )
    from tickrig.emulators.testing.fuzz import DeviceFuzz as DeviceFuzz
    from tickrig.emulators.testing.fuzz import SilentDeviceError as SilentDeviceError
    from tickrig.emulators.testing.machine import strategies as strategies
    from tickrig.emulators.testing.machine.bench_machine import BenchMachine as BenchMachine
    from tickrig.emulators.testing.machine.bench_machine import host_rule as host_rule
    from tickrig.emulators.testing.machine.bench_machine import invariant as invariant
    from tickrig.emulators.testing.machine.check_host import check_host as check_host
    from tickrig.emulators.testing.machine.check_host import replay_host as replay_host
    from tickrig.emulators.testing.machine.fuzz_one_input import fuzz_one_input as fuzz_one_input
    from tickrig.emulators.testing.properties.check_device import check_device as check_device
    from tickrig.host.canopen.master.canopen_master import open_master as open_master
    from tickrig.testing.case import BenchTestCase as BenchTestCase
    from tickrig.testing.robot import BenchLibrary as BenchLibrary
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "tickrig.emulators.testing.conformance.pytest_suite": ("conformance_tests",),
            "tickrig.emulators.testing.conformance.conformance": (
                "conformance",
                "conformance_text",
                "write_conformance",
            ),
            "tickrig.emulators.testing.fuzz": ("DeviceFuzz", "SilentDeviceError"),
            "tickrig.emulators.testing.machine": ("strategies",),
            "tickrig.emulators.testing.machine.bench_machine": (
                "BenchMachine",
                "invariant",
                "host_rule",
            ),
            "tickrig.emulators.testing.machine.check_host": ("check_host", "replay_host"),
            "tickrig.emulators.testing.machine.fuzz_one_input": ("fuzz_one_input",),
            "tickrig.emulators.testing.properties.check_device": ("check_device",),
            "tickrig.host.canopen.master.canopen_master": ("open_master",),
            "tickrig.testing.case": ("BenchTestCase",),
            "tickrig.testing.robot": ("BenchLibrary",),
        },
    )
