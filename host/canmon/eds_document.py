"""EDS files that are arguments of verbs, and the options that name such files."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.cli.messages import Refused, refusing, say, show_findings
from tickrig.host.cli.options import PATH

if TYPE_CHECKING:
    from tickrig.host.canmon.model.decode import eds_folder, node_memory
    from tickrig.host.canopen import eds
    from tickrig.host.canopen.bus_file import bus_file
    from tickrig.host.canopen.commissioning.node_bus import NodeBus
    from tickrig.host.canopen.data_sheet import document as documents
    from tickrig.wire.canopen.eds import eds_file

else:  # slow
    bus_file = LazyModule("tickrig.host.canopen.bus_file.bus_file")
    documents = LazyModule("tickrig.host.canopen.data_sheet.document")
    eds_folder = LazyModule("tickrig.host.canmon.model.decode.eds_folder")
    node_memory = LazyModule("tickrig.host.canmon.model.decode.node_memory")
    eds = LazyModule("tickrig.host.canopen.eds")
    eds_file = LazyModule("tickrig.wire.canopen.eds.eds_file")

_YAML_ENDINGS = (".yml", ".yaml")
_LOOKED_AT = 4096
"""Number of characters at the start of a file that are used to detect a binary file."""


def read_document(path: Path, what: str = "FILE", encoding: str = "") -> documents.Document:
    """Read an EDS, DCF, XDD or XDC file for a command of `canmon`.

    Args:
        path: path of the file.
        what: argument or option of the command line that named the file, for error messages.
        encoding: Python name of the file's encoding, or empty to detect the encoding.

    Raises:
        Refused: the file is unreadable, too large, binary, or of another type that the user may
            confuse with an EDS, such as a bus.yml.
    """
    with refusing(what, path=path), refusing(what, eds_file.EdsError):
        data = eds.read_eds_bytes(path)
    if _is_binary(data):
        raise Refused(f"{what} {path}: a binary file: no EDS")
    is_other = b"[" not in data[:_LOOKED_AT] or path.suffix.lower() in _YAML_ENDINGS
    if is_other and (other := bus_file.check_of(data, path)):
        raise Refused(f"{what} {path}: no EDS, but {other}")
    if path.suffix.lower() == ".toml":
        raise Refused(f"{what} {path}: TOML, not an EDS; for a rig file use: tickrig check {path}")
    return documents.Document(str(path), data, encoding)


def _is_binary(data: bytes) -> bool:
    """Return whether more than one in twenty characters is not a text character."""
    head = eds_file.decode_text(data[:_LOOKED_AT])
    return sum(letter < " " and letter not in "\t\r\n" for letter in head) * 20 > len(head)


def read_device_document(path: Path, what: str = "FILE") -> documents.Document:
    """Read a file that must describe a device. Raise Refused if it does not."""
    document = read_document(path, what)
    if not document.rows:
        raise Refused(f"{what} " + "\n".join(map(str, document.file.errors)))
    return document


_IDENTITY: Final = 0x1018


def read_identity(bus: NodeBus, node_id: int) -> eds_folder.EdsIdentity | None:
    """Read the identity object (1018h) of a node with SDO.

    The result is None if the node does not return its vendor-ID or its product code.
    """
    numbers = [read_number(bus, node_id, _IDENTITY, sub) for sub in (1, 2, 3)]
    return eds_folder.node_identity(numbers)


def read_number(bus: NodeBus, node_id: int, index: int, sub: int, size: int = 4) -> int | None:
    """Return the number in an object of a node, or None if it cannot be read."""
    try:
        return int.from_bytes(bus.read(node_id, index, sub, size), "little")
    except SdoFailed:
        return None


def chosen_eds(eds: Path | eds_folder.EdsFolder | None, bus: NodeBus, node_id: int) -> Path | None:
    """Return the path of the EDS that describes a node, or None if there is none.

    If `eds` is a file, the function returns that file. If `eds` is a folder, the function reads the
    identity of the node (1018h) and returns the file in the folder that fits it. A line on standard
    error then names the chosen file, or reports that no file fits.

    Raises:
        LinkClosed: the bus is gone.
    """
    if not isinstance(eds, eds_folder.EdsFolder):
        return eds
    identity = read_identity(bus, node_id)
    if identity is None:
        say(f"node {node_id}: no EDS is chosen: the node does not send vendor and product (1018h)")
        return None
    choice = eds.choose(node_id, identity)
    say(choice.said(node_id) if choice else f"node {node_id}: no EDS in {eds} for {identity}")
    return choice.path if choice else None


# The options that name the EDS of a node.

eds_folder_option: Final = click.option(
    "--eds-dir",
    "eds_folders",
    multiple=True,
    type=PATH,
    metavar="DIR",
    help="Search DIR for the EDS file that matches vendor, product and revision of the node"
    " (1018h).",
)


def node_eds_option(
    what: str = "EDS, DCF or XDD of the node.",
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds `--eds FILE` and `--eds-dir DIR` to a command for one node.

    The command receives both options in one argument `eds`, which is the path of a file, a folder,
    or None.

    Args:
        what: help text of `--eds`.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def with_eds(
            *words: object, eds: Path | None, eds_folders: tuple[Path, ...], **options: object
        ) -> object:
            if eds is not None and eds_folders:
                raise Refused("--eds and --eds-dir: which file? give one of them")
            return command(*words, eds=eds or read_eds_folders(eds_folders), **options)

        return click.option("--eds", type=PATH, metavar="FILE", help=what)(
            eds_folder_option(with_eds)
        )

    return decorate


def read_eds_folders(folders: Sequence[Path]) -> eds_folder.EdsFolder | None:
    """Return the folders that `--eds-dir` names, or None if the option is not given.

    Raises:
        Refused: a path is not a readable folder.
    """
    for folder in folders:
        try:
            next(folder.iterdir(), None)
        except (OSError, ValueError) as error:
            raise Refused(f"--eds-dir {folder}: {getattr(error, 'strerror', error)}") from None
    return eds_folder.EdsFolder(folders) if folders else None


_EDS: Final = re.compile(
    r"(?P<node>0[xX][0-9A-Fa-f]{1,2}|[0-9]{1,3})(?:-(?P<last>[0-9]{1,3}))?=(?P<path>.+)"
)


def read_eds_paths(
    paths: Mapping[int, Path],
    folders: Sequence[Path] = (),
    notify: Callable[[str], None] = say,
) -> eds_folder.EdsFiles:
    """Read EDS files by node-ID. Each file describes the node with this node-ID.

    Mistakes in a file are reported on standard error, and the entries with mistakes are not used.

    Args:
        paths: path of each file by node-ID.
        folders: folders with EDS files of further nodes, which are chosen by the node's identity.
        notify: function that is called with a line of text about each choice of a file.

    Raises:
        Refused: a file cannot be read, or is not an EDS.
    """
    found = {node: _read(node, path) for node, path in paths.items()}
    if found:
        show_findings(odd for objects in found.values() for odd in objects.findings)
    return eds_folder.EdsFiles(found, read_eds_folders(folders), notify)


def eds_paths(words: Sequence[str]) -> dict[int, Path]:
    """Parse the values `NODE=FILE` of the option `--eds`. Return the path of each file by node-ID.

    Raises:
        Refused: a value does not have this form.
    """
    return {node: path for word in words for node, path in _split(word).items()}


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
