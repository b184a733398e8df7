"""The options of verbs that decode frames: EDS, DBC and filter.

The decoder is imported only when a verb needs it, so that other verbs start faster.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon import eds_document
from tickrig.host.canmon.model.frames import LogTime, parse_log_time
from tickrig.host.canmon.sources.source import BusSpec, FileSpec, LogCut, parse_source
from tickrig.host.cli.can_options import BusCommand, bus_options, fd_options
from tickrig.host.cli.messages import Refused, refusing, say
from tickrig.host.cli.options import PATH, Decorator, add_options, refuse_idle

if TYPE_CHECKING:
    from tickrig.host.canmon import extensions
    from tickrig.host.canmon.model.decode import dbc_file, eds_folder, node_memory
    from tickrig.host.canmon.model.decode import filter as filters
    from tickrig.host.canmon.model.decode.decoder import Decoder
else:  # slow
    extensions = LazyModule("tickrig.host.canmon.extensions")
    dbc_file = LazyModule("tickrig.host.canmon.model.decode.dbc_file")
    filters = LazyModule("tickrig.host.canmon.model.decode.filter")


class EdsOptions(NamedTuple):
    """The values of the options `--eds` and `--eds-dir` of a command.

    Attributes:
        words: values of `--eds`, each of the form NODE=FILE.
        folders: folders in which EDS files of other nodes are searched.
    """

    words: tuple[str, ...] = ()
    folders: tuple[Path, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.words or self.folders)


_NO_EDS: Final = EdsOptions()
_PAINTED: Final = ("graph", "nodes", "top")
"""Verbs that show a screen on a terminal."""


def eds_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add `--eds` and `--eds-dir`, together as `eds`. `read_eds_files` uses this value."""
    add = click.option(
        "--eds",
        multiple=True,
        metavar="NODE=FILE",
        help="EDS, DCF or XDD of a node, such as 3=drive.eds, or of several, such as"
        " 1-3=drive.eds.",
    )

    @functools.wraps(command)
    def with_eds(
        *words: object, eds: tuple[str, ...], eds_folders: tuple[Path, ...], **options: object
    ) -> object:
        return command(*words, eds=EdsOptions(eds, eds_folders), **options)

    return add(eds_document.eds_folder_option(with_eds))


_dbc_option: Final = click.option(
    "--dbc",
    multiple=True,
    type=PATH,
    metavar="FILE",
    help="Decode with a DBC file (extra tickrig[dbc]).",
)
decode_options: Final = add_options(eds_option, _dbc_option)
"""Decorator that adds `--eds` and `--dbc`. `make_decoder` uses their values."""

filter_option: Final = click.option(
    "-F",
    "--filter",
    "wanted",
    metavar="FILTER",
    help="Take only frames that match FILTER, such as 'node=3 and (pdo or emcy)', 181-18F,"
    " 123:7FF,#FF, 'sdo[6040h]' or 'statusword.fault'.",
)
"""Decorator that adds `-F` as `wanted`. `read_filter` uses its value."""


def read_eds_files(eds: EdsOptions) -> eds_folder.EdsFiles:
    """Read the EDS files that the options `--eds` and `--eds-dir` name.

    When a node sends its identity, the matching file in a folder of `--eds-dir` is chosen and
    reported.

    Raises:
        Refused: a node, file or folder is missing or invalid.
    """
    return eds_document.read_eds_paths(
        eds_document.eds_paths(eds.words), eds.folders, _say_beside_pictures
    )


def _say_beside_pictures(text: str) -> None:
    """Print a message on standard error. If the verb shows a screen, print it after the screen."""
    context = click.get_current_context(silent=True)
    if context is not None and context.info_name in _PAINTED and sys.stdout.isatty():
        context.call_on_close(functools.partial(say, text))
    else:
        say(text)


def make_decoder(eds: EdsOptions = _NO_EDS, dbc: Sequence[Path] = ()) -> Decoder:
    """Make the decoder of a command from the files that `--eds`, `--eds-dir` and `--dbc` name.

    Raises:
        Refused: a file is invalid.
    """
    return decoder_of(read_eds_files(eds), dbc)


def decoder_of(objects: Mapping[int, node_memory.EdsObjects], dbc: Sequence[Path] = ()) -> Decoder:
    """Make a decoder from the contents of EDS files by node-ID, and from the paths of DBC files."""
    with refusing_dbc():
        return extensions.make_decoder(objects, dbc)


@contextmanager
def refusing_dbc() -> Iterator[None]:
    """Raise Refused for files that are not DBC files, as `--dbc` does."""
    with refusing("--dbc", dbc_file.DbcError):
        yield


def read_filter(text: str | None) -> filters.Filter | None:
    """Parse the filter expression of the option `-F`, or return None if the option is not given.

    Raises:
        Refused: the text is not a filter. The message names the column of the mistake.
    """
    if text is None:
        return None
    with refusing("", filters.FilterError):
        return filters.parse_filter(text)


# Common parts of verbs with SOURCE words.

_SOURCE_HELP = """\b
SOURCE   can0                      a bus of SocketCAN, or of the interface that -i or ~/.canrc names
         can0,123:7FF,400~700,#FF  candump's filters: these, not these, error frames
         slcan:/dev/ttyACM0@500k   interface:channel@bitrate; can0@500k/2M is CAN FD; udp
         serial:/dev/ttyUSB0,rrc   a port (dump, top, tui): PORT[@BAUD],rrc or ,rtc-lite
         run.log run.blf run.asc.gz  logs: candump, jsonl, asc, blf, trc, csv, mf4, pcapng, trace
         -                         standard input: what candump or canmon dump prints"""
"""Part of the help text of a verb that takes SOURCE words."""

strict_option: Final[Decorator] = click.option(
    "--strict", is_flag=True, help="Exit with status 4 on lost or invalid frames."
)

reopen_option: Final[Decorator] = click.option(
    "--reopen", is_flag=True, help="If the bus goes away, wait until it is back."
)


def cut_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add `--from` and `--to`, together as `cut`."""

    @functools.wraps(command)
    def with_cut(
        *words: object, begin: LogTime | None, end: LogTime | None, **options: object
    ) -> object:
        if begin and end and begin.dated == end.dated and begin.us > end.us:
            raise Refused(f"--to {end.text} is before --from {begin.text}")
        return command(*words, cut=LogCut(begin, end), **options)

    end = log_time_option("--to", "end", help="End at TIME, written as for --from.")
    return log_time_option(
        "--from",
        "begin",
        help="Begin at TIME in a log, such as 2.5 (s after the first frame) or a date.",
    )(end(with_cut))


def log_time_option(option: str, name: str, **attributes: Any) -> Decorator:
    """Return the option for a moment of a log. `parse_log_time` defines the notation."""

    def parsed(
        context: click.Context, parameter: click.Parameter, text: str | None
    ) -> LogTime | None:
        with refusing(option):
            return None if text is None else parse_log_time(text)

    return click.option(option, name, metavar="TIME", callback=parsed, **attributes)


def source_command(*options: Decorator) -> Callable[[Callable[..., Any]], click.Command]:
    """Return a decorator that makes a command with SOURCE words, `--strict` and the bus options.

    Args:
        options: decorators that add the further options of the command, in the order of the help.
    """
    source = click.argument("source", nargs=-1)
    add = add_options(source, *options, strict_option, bus_options, fd_options)

    def decorate(function: Callable[..., Any]) -> click.Command:
        @functools.wraps(function)
        def checked(*, source: Sequence[str], **options: object) -> object:
            refuse_idle_of_bus(source)
            return function(source=source, **options)

        return explained(click.command(cls=BusCommand)(add(checked)))

    return decorate


def refuse_idle_of_bus(source: Sequence[str]) -> None:
    """Check that bus options are given only if the SOURCE words name a bus.

    Raises:
        Refused: an option for a bus has no effect on this source.
    """
    words = [word for word in source if not word.endswith(".toml")]
    parsed = [parse_source(word) for word in words]
    if not parsed:
        return
    if all(isinstance(word, FileSpec) for word in parsed):
        refuse_idle("a log does not go away", "reopen")
    if not any(isinstance(word, BusSpec) for word in parsed):
        refuse_idle(f"{words[0]} is not a bus", "reopen" if parsed == [None] else "", *_OPENS)


_OPENS: Final = ("interface", "channel", "timing", "bus_kwargs", "fd")


def explained(command: click.Command) -> click.Command:
    """Replace `{source}` in a command's help by a description of SOURCE."""
    command.help = cleandoc(command.help or "").replace("{source}", _SOURCE_HELP)
    return command
