"""The work of `tickrig replay`: replay the devices of a trace, or a scenario of a search."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from tickrig._lazy import LazyModule
from tickrig.emulators.canopen.eds import EdsCache
from tickrig.emulators.commands.device_type import build_recorded
from tickrig.emulators.commands.run import mistakes_in
from tickrig.emulators.record import replay
from tickrig.emulators.testing.bench.recorded_device import make_recorded
from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.text.bench_header import PREFIX
from tickrig.host.text.byte_text import escape
from tickrig.host.text.user_file import find_class
from tickrig.host.text.values import counted, format_time

if TYPE_CHECKING:
    from tickrig.emulators.testing.machine import bench_machine, host_runs
else:  # replays with --host alone need them
    bench_machine = LazyModule("tickrig.emulators.testing.machine.bench_machine")
    host_runs = LazyModule("tickrig.emulators.testing.machine.host_runs")


def run_replay(file: Path, *, verbose: bool, host: str | None, run_code: bool) -> int:
    """Replay a trace, or a scenario with its host, and return the exit status."""
    if host is not None:
        return _replay_with_host(file, host)
    return _replay_trace(file, verbose=verbose, run_code=run_code)


def _replay_trace(file: Path, *, verbose: bool, run_code: bool) -> int:
    """Replay a trace, and return the exit status: 1 if the output of a device differs."""
    try:
        data = file.read_bytes()
        if any(line.startswith(b"+") for line in data.splitlines()[:2]):
            raise Refused(f"{file} is a scenario of check_host: --host FILE.py:Class replays it")
        play = _replay_bench if data.startswith(PREFIX.encode()) else _replay
        played = play(file, data, run_code)
    except OSError as error:
        refuse_path("trace", error)
    except ValueError as error:
        raise Refused(f"trace {file}: {error}") from None
    if verbose:
        for each in played:
            said = _describe("", each.difference, file) if each.difference else "identical"
            click.echo(f"{each.name or each.type}: {counted(each.ticks, 'tick')}, {said}")
    differing = [each for each in played if each.difference is not None]
    if not differing:
        click.echo(f"identical: {counted(sum(each.ticks for each in played), 'tick')}")
        return 0
    first = min(differing, key=lambda each: each.difference.at_us if each.difference else 0)
    if first.difference is not None and not verbose:
        click.echo(_describe(first.name, first.difference, file))
    return 1


def _replay_with_host(file: Path, host: str) -> int:
    """Replay a scenario; return 1 if the run fails."""
    try:
        machine = find_class(host, bench_machine.BenchMachine)
        steps = host_runs.parse_steps(file.read_text("utf-8"), str(file), machine.rules())
        runs = host_runs.HostRuns(machine)
    except OSError as error:
        refuse_path("scenario", error)
    except ValueError as error:
        raise Refused(str(error)) from None
    with runs:
        try:
            runs.run(steps)
        except BaseException as error:
            if (failure := runs.failure) is None:
                raise
            said = f"{type(error).__name__}: {error}\n{failure.text}\n{failure.passed}"
            click.echo(said)
            return 1
    click.echo(f"nothing is wrong in {counted(len(steps), 'step')}")
    return 0


class _Played(NamedTuple):
    """A replayed device; the only device of a trace has no name."""

    name: str
    type: str
    ticks: int
    difference: replay.ReplayDifference[Any] | None


def _replay(file: Path, data: bytes, run_code: bool) -> list[_Played]:
    """Replay a trace of one device on a serial line."""
    recording = replay.read_recording(data)
    with mistakes_in(recording.header.config.values()):
        difference = replay.replay(recording, build_recorded(recording.header, run_code=run_code))
    _warn(file, ended=recording.ended)
    return [_Played("", recording.header.device, recording.ticks, difference)]


def _replay_bench(file: Path, data: bytes, run_code: bool) -> list[_Played]:
    """Replay each device of a bench."""
    recording = replay.read_bench_recording(data)
    if recording.at_port:
        raise ValueError("it was recorded at a host's port, without ticks: use tickrig compare")
    found = _differences(file, recording, run_code)
    _warn(file, ended=recording.ended)
    return [
        _Played(
            name, recording.header.devices[name].type, len(recording.ticks_of(name)), difference
        )
        for name, difference in found
    ]


def _differences(
    file: Path, recording: replay.BenchRecording, run_code: bool
) -> list[tuple[str, replay.ReplayDifference[Any] | None]]:
    header, cache = recording.header, EdsCache()
    devices = header.devices
    typed = {name: entry for name, entry in devices.items() if entry.type}
    if devices and not typed:
        raise ValueError("its devices were made by a program, not of types: it cannot be replayed")
    for name in devices:
        if name not in typed:
            click.echo(f"{file}: {name} was made by a program, not of a type: left out", err=True)
    made = {
        name: make_recorded(header, name, file.parent, cache, run_code=run_code) for name in typed
    }
    return [(name, replay.replay_device(recording, name, device)) for name, device in made.items()]


def _warn(file: Path, *, ended: bool) -> None:
    if not ended:
        click.echo(f"{file}: no end line (killed?); its last tick is left out", err=True)


def _describe(name: str, difference: replay.ReplayDifference[Any], file: Path) -> str:
    place = f" ({file}:{difference.line})" if difference.line else ""
    then, now = _text(difference.recorded), _text(difference.replayed)
    at = format_time(difference.at_us)
    of = f" {name}" if name else ""
    return f"different at {at}{of}{place}\n  recorded < {then}\n  replayed < {now}"


def _text(traffic: Any) -> str:
    """Return bytes or frames as text, in the notation of a trace."""
    if not traffic:
        return "(nothing)"
    return escape(traffic) if isinstance(traffic, bytes) else " ".join(map(str, traffic))
