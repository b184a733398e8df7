"""The verb `seq`, which sends and expects frames, step by step."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon.extensions import make_decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.sequence import (
    DecodedCondition,
    EventType,
    FrameCondition,
    SequenceRun,
    TomlSequence,
    event_line,
    outline,
    parse_lines,
    parse_variable,
)
from tickrig.host.canmon.model.sequence import Sequence as Steps
from tickrig.host.canmon.model.transmit import PdoFrames
from tickrig.host.canmon.output.listening import Pace, until_interrupted
from tickrig.host.canmon.verbs.decode_options import eds_option, read_eds_files
from tickrig.host.cli.can_options import BusCommand, BusOptions, bus_and_rest, bus_options
from tickrig.host.cli.messages import Refused, refuse_path, until_unread
from tickrig.host.cli.options import refuse_idle
from tickrig.host.text.steps import StepError
from tickrig.wire.can import Frames

if TYPE_CHECKING:
    from tickrig.host.canmon.sources import bus_source
else:  # python-can is slow
    bus_source = LazyModule("tickrig.host.canmon.sources.bus_source")


class ConditionDecoder:
    """Decoder of received frames for a sequence whose conditions are filter expressions.

    Attributes:
        eds: content of EDS files by node-ID.
    """

    def __init__(self, eds: Mapping[int, EdsObjects]) -> None:
        self.eds = eds
        self._decoder, self._latest = make_decoder(eds), DecodedCondition()

    def take(self, record: Record) -> None:
        """Decode and store a frame. The next conditions apply to this frame."""
        self._latest.take(record, self._decoder.take(record))

    def condition(self, text: str) -> FrameCondition:
        """Parse a filter expression, and return a condition that tests the latest decoded frame.

        Raises:
            ValueError: the text is not a filter.
        """
        return self._latest.condition(text)


_POLL_US: Final = 100_000
_FAILED: Final = 1


@click.command(cls=BusCommand)
@click.argument("words", nargs=-1, required=True, metavar="[BUS] FILE")
@click.option(
    "--var", "variables", multiple=True, metavar="NAME=NUMBER", help="Set a variable, such as id=3."
)
@eds_option
@click.option("--dry-run", is_flag=True, help="Print the steps without opening a bus.")
@click.option("-q", "--quiet", is_flag=True, help="Print only missed expectations.")
@bus_options
@click.pass_context
def command(context: click.Context, /, words: Sequence[str], **options: Any) -> None:
    """Run the sequence FILE on BUS. The exit status is 1 if an expectation was missed.

    Without a BUS, -c names the bus. A TOML file has steps that send, wait, expect and repeat. An
    expect step contains a frame, a filter, or a list of frames and filters. A step with a list
    waits for all frames of the list, in any order. Any other file has lines such as '+10
    123#DEADBEEF', which sends a frame 10 ms after the line above.

    \b
    [vars]
    id = 5
    [[step]]
    send = "000#01{id}"
    [[step]]
    expect = "{0x700+id:3}#05"       # or a filter: "node=5 and heartbeat"
    within = "300ms"
    on-fail = "go-on"                # or "stop", or steps

    \b
    canmon seq can0 start.toml --var id=3
    canmon seq can0 start.toml --dry-run
    """  # noqa: D301 - click wants the backspace
    variables, eds = options.pop("variables"), options.pop("eds")
    dry_run, quiet = options.pop("dry_run"), options.pop("quiet")
    bus, files = bus_and_rest(words, options["channel"], "FILE", most=1)
    file = Path(files[0])
    watch = ConditionDecoder(read_eds_files(eds))
    sequence = _read(file, variables, watch)
    if dry_run:
        refuse_idle("--dry-run prints the steps, and nothing else", "quiet")
        click.echo("\n".join(outline(sequence.steps)))
        return
    run = SequenceRun(sequence)
    _carry_out(run, bus, BusOptions(**options), watch, quiet)
    if not run.done:
        click.echo("interrupted before its end", err=True)
    if run.missed or not run.done:
        context.exit(_FAILED)


def _read(file: Path, words: Sequence[str], watch: ConditionDecoder) -> Steps:
    try:
        variables = dict(map(parse_variable, words))
        text = file.read_text("utf-8")
        for name in variables:
            if name not in text:
                raise Refused(f"--var {name}: {file} does not name it")
        if file.suffix != ".toml":
            return parse_lines(text, str(file))
        resolve = PdoFrames(watch.eds).frame
        return TomlSequence(
            text, str(file), variables, resolve=resolve, condition=watch.condition
        ).parse()
    except OSError as error:
        refuse_path("sequence", error)
    except UnicodeDecodeError:
        raise Refused(f"{file} is no text") from None
    except (StepError, ValueError) as error:
        raise Refused(str(error)) from None


def _carry_out(
    run: SequenceRun, bus: str | None, options: BusOptions, watch: ConditionDecoder, quiet: bool
) -> None:
    with (
        bus_source.transmitters([bus], options, receives=True) as (out,),
        until_interrupted(),
        until_unread(),
    ):
        pace = Pace()
        _send(out, watch, run.tick(pace.now_us))
        while not run.done:
            _show(run, quiet)
            for record in out.poll(max(0, min(_POLL_US, run.due_us - pace.now_us))):
                watch.take(record)
                _send(out, watch, run.tick(pace.now_us, (record,)))
            _send(out, watch, run.tick(pace.now_us))
        _show(run, quiet)
        if run.missed:
            out.check_reads()
    _show(run, quiet)


def _send(out: bus_source.Transmitter, watch: ConditionDecoder, frames: Frames) -> None:
    for frame in frames:
        out.send(frame)
        watch.take(Record(time.time_ns() // 1_000, out.name, frame, sent=True))


def _show(run: SequenceRun, quiet: bool) -> None:
    """Print the events since the last call."""
    for event in run.events:
        if not quiet or event.mark is EventType.MISSED:
            click.echo(event_line(event))
    run.events.clear()
