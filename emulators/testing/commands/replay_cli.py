"""The command `tickrig replay`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from tickrig.host.cli.messages import Refused, refuse_path
from tickrig.host.cli.options import PATH, run_code_option
from tickrig.host.cli.start import loading
from tickrig.host.text.byte_text import escape
from tickrig.host.text.values import counted, format_time

if TYPE_CHECKING:
    from tickrig.emulators.record.replay import BenchRecording, ReplayDifference


@click.command("replay")
@click.argument("file", type=PATH)
@click.option("-v", "--verbose", is_flag=True, help="Each device: its ticks, and what differs.")
@click.option(
    "--host",
    metavar="FILE.py:Class",
    help="FILE is a scenario that a search has found: do it with this BenchMachine.",
)
@run_code_option
@click.pass_context
def replay_command(
    context: click.Context, /, file: Path, *, verbose: bool, host: str | None, run_code: bool
) -> None:
    """Replay the trace FILE on fresh devices; exit status 1 if one says anything else.

    With --host a scenario of check_host is done again, with a fresh bench and host; exit status 1
    if something is still wrong.

    \b
    rrc-emu --link /tmp/rrc --trace run.trace
    tickrig replay run.trace
    tickrig replay found.txt --host test_chair.py:Chair
    """  # noqa: D301 - click wants the backspace
    if host is not None:
        context.exit(_replay_host(file, host))
    with loading():
        from tickrig.host.text.bench_header import PREFIX  # noqa: PLC0415 - slow

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
        return
    first = min(differing, key=lambda each: each.difference.at_us if each.difference else 0)
    if first.difference is not None and not verbose:
        click.echo(_describe(first.name, first.difference, file))
    context.exit(1)


def _replay_host(file: Path, host: str) -> int:
    """Do a scenario again; return 1 if something is wrong."""
    with loading():
        from tickrig.emulators.testing.machine.bench_machine import BenchMachine  # noqa: PLC0415
        from tickrig.emulators.testing.machine.host_runs import (  # noqa: PLC0415
            HostRuns,
            parse_steps,
        )
        from tickrig.host.text.user_file import find_class  # noqa: PLC0415

    try:
        steps = parse_steps(file.read_text("utf-8"), str(file))
        runs = HostRuns(find_class(host, BenchMachine))
    except OSError as error:
        refuse_path("scenario", error)
    except ValueError as error:
        raise Refused(str(error)) from None
    with runs:
        try:
            runs.run(steps)
        except Exception as error:  # what a host may raise
            click.echo(f"{type(error).__name__}: {error}\n{runs.last_lines()}")
            return 1
    click.echo(f"nothing is wrong in {counted(len(steps), 'step')}")
    return 0


class _Played(NamedTuple):
    """A device that was replayed; it has no name where it is the only one."""

    name: str
    type: str
    ticks: int
    difference: ReplayDifference[Any] | None


def _replay(file: Path, data: bytes, run_code: bool) -> list[_Played]:
    """Replay a trace of one device on a serial line."""
    with loading():
        from tickrig.emulators.commands.device_type import build_recorded  # noqa: PLC0415 - slow
        from tickrig.emulators.commands.run import mistakes_in  # noqa: PLC0415
        from tickrig.emulators.record.replay import read_recording, replay  # noqa: PLC0415

    recording = read_recording(data)
    with mistakes_in(recording.header.config.values()):
        difference = replay(recording, build_recorded(recording.header, run_code=run_code))
    _warn(file, ended=recording.ended)
    return [_Played("", recording.header.device, recording.ticks, difference)]


def _replay_bench(file: Path, data: bytes, run_code: bool) -> list[_Played]:
    """Replay each device of a bench."""
    with loading():
        from tickrig.emulators.record.replay import read_bench_recording  # noqa: PLC0415

    recording = read_bench_recording(data)
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
    file: Path, recording: BenchRecording, run_code: bool
) -> list[tuple[str, ReplayDifference[Any] | None]]:
    from tickrig.emulators.canopen.eds import EdsCache  # noqa: PLC0415 - slow
    from tickrig.emulators.record.replay import replay_device  # noqa: PLC0415
    from tickrig.emulators.testing.bench.recorded_device import (  # noqa: PLC0415
        make_recorded,
    )

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
    return [(name, replay_device(recording, name, device)) for name, device in made.items()]


def _warn(file: Path, *, ended: bool) -> None:
    if not ended:
        click.echo(f"{file}: no end line (killed?); its last tick is left out", err=True)


def _describe(name: str, difference: ReplayDifference[Any], file: Path) -> str:
    place = f" ({file}:{difference.line})" if difference.line else ""
    then, now = _text(difference.recorded), _text(difference.replayed)
    at = format_time(difference.at_us)
    of = f" {name}" if name else ""
    return f"different at {at}{of}{place}\n  recorded < {then}\n  replayed < {now}"


def _text(traffic: Any) -> str:
    """Return bytes or frames as a trace has them."""
    if not traffic:
        return "(nothing)"
    return escape(traffic) if isinstance(traffic, bytes) else " ".join(map(str, traffic))
