"""The command `tickrig compare`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig.emulators.commands.run_options import type_option
from tickrig.host.cli.messages import Refused, refuse_path, refused_at, say, show_findings
from tickrig.host.cli.options import PATH, add_options, run_code_option, time_option
from tickrig.host.cli.start import loading

if TYPE_CHECKING:
    from tickrig.emulators.commands.device_type import ConfiguredDevice
    from tickrig.emulators.record.comparison import Tolerance
    from tickrig.emulators.record.replay import BenchRecording
    from tickrig.emulators.testing.commands.compare import ComparedRun

_BIT_RATE: Final = 1_000_000

_device: Final = add_options(
    type_option("Device type, if the trace has none."),
    click.option(
        "--config", multiple=True, metavar="NAME=VALUE", help="An option of that type: node=lite-a."
    ),
    click.option(
        "--node", "nodes", multiple=True, metavar="ID=DEVICE", help="On a bus: 5=epos, 5=drive.eds."
    ),
    time_option("--settle", "settle_us", default="1s", help="On for so long before it.  [1s]"),
)
_tolerance: Final = add_options(
    time_option("--tolerance", "time_us", default="20ms", help="Of each time.  [20ms]"),
    click.option(
        "--number",
        "numbers",
        multiple=True,
        metavar="PATTERN=MOST",
        help="Numbers in such lines may differ: 'EV:batt*=5', '181#*[2:4]=1%'.",
    ),
    click.option("--ignore", multiple=True, metavar="PATTERN", help="Lines not compared."),
    click.option(
        "--kind",
        "kinds",
        multiple=True,
        metavar="PATTERN",
        help="Lines in an order of their own.",
    ),
)


@click.command("compare")
@click.argument("file", type=PATH)
@_device
@_tolerance
@run_code_option
@click.option("-v", "--verbose", is_flag=True, help="All that was said, the same too.")
@click.pass_context
def compare_command(
    context: click.Context, /, *, file: Path, verbose: bool, **options: Any
) -> None:
    """Let the host of a recorded run talk to an emulator; say where it answers otherwise.

    FILE is a trace of 'tickrig record', of an emulator or of a bench. Exit status 0 if the
    emulator says the same, 1 if not, 2 if it cannot be compared.

    \b
    tickrig record /dev/ttyUSB0 --out run.trace --type rrc --link /tmp/rrc
    tickrig compare run.trace
    tickrig compare run.trace --tolerance 50ms --ignore 'Version*' --number 'EV:batt*=5'
    """  # noqa: D301 - click wants the backspace
    with loading():
        from tickrig.emulators.commands.run import mistakes_in  # noqa: PLC0415 - slow
        from tickrig.emulators.record.comparison import compare  # noqa: PLC0415 - slow
        from tickrig.emulators.record.replay import read_bench_recording  # noqa: PLC0415
        from tickrig.emulators.testing.bench.recorded_device import user_code  # noqa: PLC0415
        from tickrig.emulators.testing.commands.compare import report  # noqa: PLC0415

    tolerance = _read_tolerance(options)
    try:
        recording = read_bench_recording(file.read_bytes())
        mine = [*user_code(recording.header.devices.values()), *_given_code(options)]
        with mistakes_in(mine):
            runs = dict(_runs(file, recording, tolerance, options))
    except OSError as error:
        refuse_path("trace", error)
    except ValueError as error:
        raise Refused(f"trace {file}: {error}") from None
    if not any(run.recorded for run in runs.values()):
        raise Refused(f"trace {file}: no device says anything in it that could be compared")
    if not recording.ended:
        say(f"{file}: no end line (killed?); its last tick is left out")
    pairs = {
        name: compare(run.recorded, run.emulated, recording.until_us, tolerance)
        for name, run in runs.items()
    }
    lines, same = report(str(file), pairs, tolerance.time_us, everything=verbose)
    for line in lines:
        click.echo(line)
    context.exit(0 if same else 1)


def _given_code(options: Mapping[str, Any]) -> list[str]:
    """Return what may be a `FILE.py:Class` of a user in --node and --config."""
    return [text.partition("=")[2] for text in (*options["nodes"], *options["config"])]


def _read_tolerance(options: Mapping[str, Any]) -> Tolerance:
    from tickrig.emulators.record.comparison import Tolerance, parse_number_rule  # noqa: PLC0415

    with refused_at("--number"):
        numbers = [parse_number_rule(text) for text in options["numbers"]]
    return Tolerance(options["time_us"], numbers, options["ignore"], options["kinds"])


def _runs(
    file: Path, recording: BenchRecording, tolerance: Tolerance, options: Mapping[str, Any]
) -> Iterator[tuple[str, ComparedRun]]:
    """Give the two runs of each device, of a recorded bus those of all nodes together."""
    for name in recording.header.devices:
        if not recording.at_port:
            yield name, _ticked(file, recording, name, options)
        elif recording.header.on_can(name):
            yield name, _on_bus(recording, name, tolerance, options)
        else:
            yield name, _on_line(recording, name, tolerance, options)


def _ticked(
    file: Path, recording: BenchRecording, name: str, options: Mapping[str, Any]
) -> ComparedRun:
    """Compare tick by tick."""
    from tickrig.emulators.canopen.eds import EdsCache  # noqa: PLC0415 - slow
    from tickrig.emulators.commands.device_type import DEVICES, ConfiguredDevice  # noqa: PLC0415
    from tickrig.emulators.testing.bench.recorded_device import make_recorded  # noqa: PLC0415
    from tickrig.emulators.testing.commands.compare import (  # noqa: PLC0415
        compare_node_ticks,
        compare_ticks,
    )

    header = recording.header
    entry, on_can = header.devices[name], header.on_can(name)
    if options["type_name"] and not on_can:
        return compare_ticks(recording, name, _configured(options, ""))
    device = make_recorded(header, name, file.parent, EdsCache(), run_code=options["run_code"])
    if on_can:
        return compare_node_ticks(recording, name, device)
    configured = ConfiguredDevice(DEVICES.load(entry.type), device, entry.config)
    return compare_ticks(recording, name, configured)


def _on_line(
    recording: BenchRecording, name: str, tolerance: Tolerance, options: Mapping[str, Any]
) -> ComparedRun:
    """Compare what passed a serial port."""
    from tickrig.emulators.testing.commands.compare import compare_port  # noqa: PLC0415

    recorded = recording.header.devices[name].type
    if not (recorded or options["type_name"]):
        raise ValueError("it does not say of which type the device is: add --type, as --type rrc")

    def make() -> ConfiguredDevice:
        return _configured(options, recorded)

    return compare_port(recording, name, make, tolerance, options["settle_us"])


def _on_bus(
    recording: BenchRecording, name: str, tolerance: Tolerance, options: Mapping[str, Any]
) -> ComparedRun:
    """Compare what passed a bus."""
    from tickrig.emulators.canopen.build import describe_nodes, make_nodes  # noqa: PLC0415 - slow
    from tickrig.emulators.canopen.node_spec import parse_node  # noqa: PLC0415
    from tickrig.emulators.testing.commands.compare import compare_bus  # noqa: PLC0415

    try:
        specs = [spec for text in options["nodes"] for spec in parse_node(text)]
        described = describe_nodes(specs)
    except ValueError as error:
        raise Refused(str(error)) from None
    if not specs:
        raise ValueError("which nodes were on the bus? add --node, as --node 5=epos")
    show_findings(odd for item in described for odd in item.description.warnings)
    wire = recording.header.wires[recording.header.devices[name].wire]
    bit_rate = wire.config.get("bit_rate", _BIT_RATE)
    if not isinstance(bit_rate, int):
        raise ValueError(f"its bit rate is {bit_rate!r:.60}")
    return compare_bus(
        recording,
        lambda bus: make_nodes(described, bus),
        tolerance,
        options["settle_us"],
        bit_rate,
    )


def _configured(options: Mapping[str, Any], recorded: str) -> ConfiguredDevice:
    """Make the device of --type and --config, or of the trace."""
    from tickrig.emulators.commands.device_type import DEVICES, configure  # noqa: PLC0415
    from tickrig.host.text.names import near  # noqa: PLC0415
    from tickrig.host.text.values import parse_setting  # noqa: PLC0415

    name = options["type_name"] or recorded
    if name not in DEVICES.names():
        raise Refused(f"no device type {name!r:.60}; {near(name, DEVICES.names())}")
    words: Sequence[str] = options["config"]
    with refused_at("--config"):
        config = {}
        for word in words:
            key, equals, value = word.partition("=")
            if not equals:
                raise ValueError(f"{word!r} is not NAME=VALUE")
            config[key] = parse_setting(value)
        return configure(name, config)
