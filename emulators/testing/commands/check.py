"""Check rig files and bus.yml for `tickrig check`: print findings, or the devices of the bench."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

import click

from tickrig.emulators.canopen.bus_file.bus_nodes import check_nodes
from tickrig.emulators.testing.rig_file.plan import RigFileError, summary
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.host.canopen.bus_file.bus_checks import check_sheets
from tickrig.host.canopen.bus_file.bus_file import BusFile, check_of, read_bus_file
from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusSlave
from tickrig.host.canopen.data_sheet.rule import Severity
from tickrig.host.canopen.master.cia402.bus_load import check_load
from tickrig.host.cli.messages import say
from tickrig.host.cli.start import raise_of_output

_MISTAKES: Final = 1
_UNREADABLE: Final = 2
_EDS_ENDINGS: Final = (".eds", ".dcf", ".xdd", ".xdc")
_LOOKED_AT: Final = 65_536
"""Number of bytes at the start of a file by which a bus.yml is recognised."""


def check_files(files: tuple[Path, ...], strict: bool) -> int:
    """Check rig files and bus.yml files, and print the result.

    Returns:
        The exit status: 0 without errors, 1 for errors, 2 for an unreadable file.
    """
    return max([_check(file, strict) for file in files])


def _check(file: Path, strict: bool) -> int:
    """Check a file, and return the exit status."""
    if file.suffix.lower() in _EDS_ENDINGS:
        say(f"Error: {file}: an EDS, no rig file or bus.yml; use: canmon eds check {file}")
        return _UNREADABLE
    kind = _kind(file)
    if "System Definition" in kind:
        say(f"Error: {file}: no rig file or bus.yml, but {kind}")
        return _UNREADABLE
    try:
        return _check_bus(file, strict=strict) if kind else _check_rig(file)
    except ImportError as error:
        say(f"Error: {file}: {error}")
        return _UNREADABLE
    except OSError as error:
        raise_of_output(error)
        say(f"Error: {file}: {error.strerror}")
        return _UNREADABLE


def _kind(file: Path) -> str:
    """Return the kind of a YAML file, or "" for other files and for pipes (read only once)."""
    with suppress(OSError):
        if file.is_file():
            with file.open("rb") as opened:
                return check_of(opened.read(_LOOKED_AT), file)
    return ""


def _check_rig(file: Path) -> int:
    try:
        first, *wires = summary(read_rig_file(file))
    except RigFileError as error:
        click.echo(str(error))
        return _MISTAKES
    click.echo("\n".join([f"{file}: ok: {first}", *wires]))
    return 0


def _check_bus(file: Path, *, strict: bool) -> int:
    """Check a bus.yml, and return the exit status.

    Args:
        file: path of the file, which messages contain.
        strict: whether warnings count as errors.

    Raises:
        OSError: the file cannot be read.
        ImportError: PyYAML is not installed.
    """
    bus = read_bus_file(file)
    found = [*bus.findings, *check_nodes(bus), *check_load(bus)]
    found.sort(key=lambda one: (one.file, one.line))
    found += check_sheets(bus.slaves)
    for finding in found:
        click.echo(str(finding))
    severities = [one.rule.severity for one in found]
    warnings = severities.count(Severity.WARNING)
    if Severity.ERROR in severities or (strict and warnings):
        return _MISTAKES
    click.echo("\n".join([f"{file}: {_verdict(warnings)}: {_head(bus)}", *_slaves(bus)]))
    return 0


def _verdict(warnings: int) -> str:
    return f"ok, with {warnings} warning{'' if warnings == 1 else 's'}" if warnings else "ok"


def _head(bus: BusFile) -> str:
    slaves = "1 slave" if len(bus.slaves) == 1 else f"{len(bus.slaves)} slaves"
    return f"{slaves}, {_master(bus.master) if bus.master else 'no master'}"


def _master(master: BusMaster) -> str:
    words = [f"master {master.node_id}"]
    if master.sync_period_us:
        words.append(f"SYNC each {master.sync_period_us / 1_000:g} ms")
    if master.heartbeat_producer_ms:
        words.append(f"heartbeat each {master.heartbeat_producer_ms} ms")
    return ", ".join(words)


def _slaves(bus: BusFile) -> Iterator[str]:
    """Yield a line for each slave."""
    width = max(map(len, bus.slaves), default=0)
    for name, slave in bus.slaves.items():
        yield f"  {name:{width}}  {_slave(slave)}"


def _slave(slave: BusSlave) -> str:
    count = len(slave.writes)
    words = [
        f"node-ID {slave.node_id}",
        slave.sheet.name,
        f"{count} write{'' if count == 1 else 's'} at boot-up" if slave.boot else "not booted",
    ]
    if slave.heartbeat_producer_ms:
        words.append(f"heartbeat each {slave.heartbeat_producer_ms} ms")
    if slave.num_channels > 1:
        words.append(f"axes {', '.join(slave.channel_names)}")
    return ", ".join(words)
