"""The options of verbs that decode: EDS, DBC and filter.

The decoder is imported when it is wanted: a verb that does without starts faster.
"""

from __future__ import annotations

import functools
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon import eds_document
from tickrig.host.cli.can_options import BusCommand, bus_options, fd_options
from tickrig.host.cli.messages import Refused, refusing, say, show_findings
from tickrig.host.cli.options import PATH, Decorator, add_options

if TYPE_CHECKING:
    from tickrig.host.canmon import extensions
    from tickrig.host.canmon.model.decode import dbc_file, eds_folder, node_memory
    from tickrig.host.canmon.model.decode import filter as filters
    from tickrig.host.canmon.model.decode.decoder import Decoder
    from tickrig.wire.canopen.eds import eds_file
else:  # slow
    extensions = LazyModule("tickrig.host.canmon.extensions")
    dbc_file = LazyModule("tickrig.host.canmon.model.decode.dbc_file")
    eds_folder = LazyModule("tickrig.host.canmon.model.decode.eds_folder")
    filters = LazyModule("tickrig.host.canmon.model.decode.filter")
    node_memory = LazyModule("tickrig.host.canmon.model.decode.node_memory")
    eds_file = LazyModule("tickrig.wire.canopen.eds.eds_file")


_EDS: Final = re.compile(
    r"(?P<node>0[xX][0-9A-Fa-f]{1,2}|[0-9]{1,3})(?:-(?P<last>[0-9]{1,3}))?=(?P<path>.+)"
)


class EdsOptions(NamedTuple):
    """What `--eds` and `--eds-dir` give.

    Attributes:
        words: NODE=FILE.
        folders: in which files of other nodes are looked for.
    """

    words: tuple[str, ...] = ()
    folders: tuple[Path, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.words or self.folders)


_NO_EDS: Final = EdsOptions()
_PAINTED: Final = ("graph", "nodes", "top")
"""Verbs that paint a screen on a terminal."""


def eds_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add `--eds` and `--eds-dir`, together as `eds`; `read_eds_files` takes it."""
    add = click.option(
        "--eds",
        multiple=True,
        metavar="NODE=FILE",
        help="An EDS, DCF or XDD of a node, as 3=drive.eds, or of several, as 1-3=drive.eds.",
    )

    @functools.wraps(command)
    def with_eds(
        *words: object, eds: tuple[str, ...], eds_folders: tuple[Path, ...], **options: object
    ) -> object:
        return command(*words, eds=EdsOptions(eds, eds_folders), **options)

    return add(eds_document.eds_folder_option(with_eds))


_dbc_option: Final = click.option(
    "--dbc", multiple=True, type=PATH, metavar="FILE", help="A DBC file (extra tickrig[dbc])."
)
decode_options: Final = add_options(eds_option, _dbc_option)
"""Add `--eds` and `--dbc`; `make_decoder` takes what they give."""

filter_option: Final = click.option(
    "-F",
    "--filter",
    "wanted",
    metavar="FILTER",
    help="Only these: 'node=3 and (pdo or emcy)', 181-18F, 123:7FF,#FF, 'sdo[6040h]',"
    " 'statusword.fault'.",
)
"""Add `-F`, as `wanted`; `read_filter` takes what it gives."""


def read_eds_files(eds: EdsOptions) -> eds_folder.EdsFiles:
    """Read what `--eds` names; Refused if there is no such node, file or folder, or it is no EDS.

    Files of the folders are chosen when a node tells its identity, and each choice is said.
    """
    return read_eds_paths(eds_paths(eds.words), eds.folders, _say_beside_pictures)


def _say_beside_pictures(text: str) -> None:
    """Say something on standard error; where the verb paints a screen, after that."""
    context = click.get_current_context(silent=True)
    if context is not None and context.info_name in _PAINTED and sys.stdout.isatty():
        context.call_on_close(functools.partial(say, text))
    else:
        say(text)


def read_eds_paths(
    paths: Mapping[int, Path],
    folders: Sequence[Path] = (),
    notify: Callable[[str], None] = say,
) -> eds_folder.EdsFiles:
    """Read files by node-ID; Refused if one cannot be read, or is no EDS.

    What is wrong in a file, and not used, is told on standard error.

    Args:
        paths: the files.
        folders: in which those of other nodes are looked for.
        notify: takes a line about each choice.
    """
    found = {node: _read(node, path) for node, path in paths.items()}
    show_findings(odd for objects in found.values() for odd in objects.findings)
    return eds_folder.EdsFiles(found, eds_document.read_eds_folders(folders), notify)


def make_decoder(eds: EdsOptions = _NO_EDS, dbc: Sequence[Path] = ()) -> Decoder:
    """Make a decoder of what `--eds` and `--dbc` name; Refused if a file is none."""
    return decoder_of(read_eds_files(eds), dbc)


def decoder_of(objects: Mapping[int, node_memory.EdsObjects], dbc: Sequence[Path] = ()) -> Decoder:
    """Make a decoder of what `--eds` names and was read, and of what `--dbc` names."""
    with refusing_dbc():
        return extensions.make_decoder(objects, dbc)


@contextmanager
def refusing_dbc() -> Iterator[None]:
    """Refuse, as `--dbc` does, files that are no DBC."""
    with refusing("--dbc", dbc_file.DbcError):
        yield


def eds_paths(words: Sequence[str]) -> dict[int, Path]:
    """Return the files that `--eds` names, by node-ID; Refused if a word is wrong."""
    return {node: path for word in words for node, path in _split(word).items()}


def read_filter(text: str | None) -> filters.Filter | None:
    """Read what `-F` says; Refused with the column if it is no filter."""
    if text is None:
        return None
    with refusing("", filters.FilterError):
        return filters.parse_filter(text)


def _split(word: str) -> dict[int, Path]:
    match = _EDS.fullmatch(word)
    text = match["node"] if match else "0"
    node = int(text, 16 if text[1:2] in ("x", "X") else 10)
    last = int(match["last"]) if match and match["last"] else node
    if match is None or not 1 <= node <= last <= 127:
        raise Refused(
            f"--eds {word!r} is not NODE=FILE with a node-ID 1..127, as 3=drive.eds"
            " or 1-3=drive.eds"
        )
    return dict.fromkeys(range(node, last + 1), Path(match["path"]))


def _read(node: int, path: Path) -> node_memory.EdsObjects:
    with refusing("--eds", eds_file.EdsError):
        return node_memory.read_eds_objects(path, node)


# What verbs that take SOURCE words share.

_SOURCE_HELP = """\b
SOURCE   can0                      a bus of SocketCAN, or of the interface that -i or ~/.canrc names
         can0,123:7FF,400~700,#FF  candump's filters: these, not these, error frames
         slcan:/dev/ttyACM0@500k   interface:channel@bitrate; can0@500k/2M is CAN FD; udp
         serial:/dev/ttyUSB0,rrc   a port (dump, top, tui): PORT[@BAUD],rrc or ,rtc-lite
         run.log run.blf run.asc.gz  logs: candump, jsonl, asc, blf, trc, csv, mf4, pcapng, trace
         -                         standard input: what candump or canmon dump prints"""
"""For the help text of a verb that takes SOURCE words."""

strict_option: Final[Decorator] = click.option(
    "--strict", is_flag=True, help="Exit status 4 if frames were lost or bad."
)

reopen_option: Final[Decorator] = click.option(
    "--reopen", is_flag=True, help="Wait for a bus that goes away until it is back."
)


def source_command(*options: Decorator) -> Callable[[Callable[..., Any]], click.Command]:
    """Return a decorator that makes a verb with SOURCE words, `--strict`, and those of a bus.

    Args:
        options: what else the verb has, in the order of its help.
    """
    source = click.argument("source", nargs=-1)
    add = add_options(source, *options, strict_option, bus_options, fd_options)

    def decorate(function: Callable[..., Any]) -> click.Command:
        return explained(click.command(cls=BusCommand)(add(function)))

    return decorate


def explained(command: click.Command) -> click.Command:
    """Put what a SOURCE may be in the place of `{source}` in a command's help."""
    command.help = cleandoc(command.help or "").replace("{source}", _SOURCE_HELP)
    return command
