"""Run a resolution service as its command line asks."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import click

from tickrig.emulators.bench.fault_spec import parse_fault_spec
from tickrig.emulators.tkernel.operated import Operated
from tickrig.emulators.tkernel.resolution.http_service import HttpService
from tickrig.emulators.tkernel.resolution.service import ResolutionService
from tickrig.emulators.tkernel.resolution.table import EXAMPLE, Table, parse_table
from tickrig.host.cli.messages import say, warnings_shown
from tickrig.host.cli.refused import Refused, refuse_path, refused_at
from tickrig.host.cli.serving import serving_control, stopped_by_signals
from tickrig.host.control.clock import ServingClock

LOOK_US = 20_000
"""How often it looks at its faults."""


def print_example() -> None:
    """Print a table to begin with."""
    click.echo(EXAMPLE, nl=False)


def read_table(path: Path) -> Table:
    """Read the table of a file; Refused if it is none."""
    try:
        return parse_table(path.read_text("utf-8"))
    except OSError as error:
        refuse_path("table", error)
    except ValueError as error:
        raise Refused(f"table {path}: {error}") from None


def run_service(
    table: Path | None, *, port: int, control: Path | None, faults: tuple[str, ...]
) -> None:
    """Serve until somebody stops it.

    Raises:
        Refused: the command line asks for something that cannot be done.
    """
    if table is None:
        raise Refused("give a TABLE, or --example for one to begin with")
    service = ResolutionService(read_table(table), "")
    running = [True]
    operated = Operated("ucode-resolver", service, running.clear)
    with refused_at("--fault"):
        operated.plan(map(parse_fault_spec, faults))
    clock = ServingClock()
    with warnings_shown(), ExitStack() as stack:
        stack.enter_context(stopped_by_signals(running.clear))
        http = _open(service, port)
        stack.callback(http.close)
        if control is not None:
            stack.enter_context(serving_control(control, operated, clock))
        click.echo(http.url)
        say(f"{len(service.table.ucodes)} ucodes at {http.url}/ucodes/UCODE. Ctrl-C ends.")
        while running:
            clock.wait_until(clock.now_us + LOOK_US)
            operated.tick(clock.now_us)
            http.follow()
    say(f"requests: {service.read('requests')}; unknown: {service.read('unknown')}")


def _open(service: ResolutionService, port: int) -> HttpService:
    try:
        return HttpService(service, port)
    except OSError as error:
        raise Refused(f"--port {port}: {error.strerror}") from None
