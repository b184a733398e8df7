"""Entry point for coverage-guided fuzzers: a function of bytes that raises the errors it finds."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from tickrig.emulators.testing.fuzz import DeviceFuzz
from tickrig.emulators.testing.machine.bench_machine import BenchMachine
from tickrig.emulators.testing.machine.check_host import note_of, search_of
from tickrig.emulators.testing.machine.host_runs import HostRuns


def fuzz_one_input(
    what: type[BenchMachine] | Any, *, max_steps: int = 12, **options: Any
) -> Callable[[bytes], None]:
    r"""Return a function that a fuzzer such as Atheris calls with bytes.

    Each call starts from the same snapshot.

    Args:
        what: a `BenchMachine` or a device. For a `BenchMachine`, Hypothesis chooses the steps from
            the bytes, and the bench stays open. For a device, the bytes are decoded as in
            `DeviceFuzz`.
        max_steps: largest number of steps in a run of the machine.
        options: options of `DeviceFuzz`.

    Returns:
        The function for the fuzzer. The function raises the exception of the device, the host or
        the machine, with a note that lists the steps. The note is also printed on standard error,
        because fuzzers do not show notes.

    Raises:
        ModuleNotFoundError: `what` is a machine, and Hypothesis is not installed.

    >>> one_input = fuzz_one_input("rrc", words=[b"device"], request=[b"\ndevice\n"], answer=b"RRC")
    >>> one_input(b"any bytes")
    """
    if isinstance(what, type) and issubclass(what, BenchMachine):
        return printing_notes(_OneInput(what, max_steps))
    return printing_notes(DeviceFuzz(what, **options))


def printing_notes(one_input: Callable[[bytes], object]) -> Callable[[bytes], None]:
    """Return a function that also prints the notes of the exceptions that it raises."""

    def print_notes(data: bytes) -> None:
        try:
            one_input(data)
        except Exception as error:
            print(*getattr(error, "__notes__", ()), sep="\n", file=sys.stderr, flush=True)
            raise

    return print_notes


class _OneInput:
    """Function that runs a machine with steps from bytes."""

    def __init__(self, machine: type[BenchMachine], max_steps: int) -> None:
        self._runs = HostRuns(machine)
        self._runs.__enter__()
        try:
            search = search_of(self._runs, max_examples=1, max_steps=max_steps)
        except BaseException:
            self._runs.__exit__()
            raise
        self._fuzz: Callable[[bytes], object] = search.hypothesis.fuzz_one_input

    def __call__(self, data: bytes) -> None:
        try:
            self._fuzz(data)
        except Exception:
            failure = self._runs.failure
            if failure is None:
                raise
            shortest = self._runs.shorten(failure)
            failed = shortest or failure
            failed.error.add_note(note_of(self._runs, failed, repeats=shortest is not None))
            raise failed.error from None
