"""Run a server on a link: a rig in virtual time, or a real bus."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tickrig.host.links.link import StampedLink
from tickrig.host.rtc_canopen.definition.definition import SystemDefinition
from tickrig.host.rtc_canopen.definition.definition_reader import read_definition
from tickrig.host.rtc_canopen.definition.device_file import DeviceFile, read_device_file
from tickrig.host.rtc_canopen.errors import DefinitionError
from tickrig.host.rtc_canopen.server import Server
from tickrig.wire.instant import NEVER


def serve(
    server: Server,
    link: StampedLink,
    until_us: int = NEVER,
    done: Callable[[], bool] = lambda: False,
) -> None:
    """Let a server work until a time on the link's clock, or until `done()`.

    Raises:
        LinkClosed: the bus is gone.
    """
    while link.now_us < until_us and not done():
        now_us, heard = link.hear(max(0, min(server.due_us, until_us) - link.now_us))
        if sent := server.tick(now_us, heard):
            link.send(sent)


def open_server(path: Path) -> Server:
    """Make a server of a System Definition and the EDS files beside it.

    Raises:
        OSError: the definition cannot be read.
        DefinitionError: it or an EDS cannot be used; the line says where and why.
    """
    definition = read_definition(path)
    return Server(definition, read_files(definition, path.parent))


def read_files(definition: SystemDefinition, folder: Path) -> dict[str, DeviceFile]:
    """Read the EDS files of a definition, each once.

    Raises:
        DefinitionError: one cannot be used, or has not a PDO that the definition names.
    """
    names = dict.fromkeys(node.eds for node in definition.nodes)
    files = {name: read_device_file(folder / name) for name in names}
    by_id = {node.id: files[node.eds] for node in definition.nodes}
    for pdo in definition.named_pdos:
        if pdo.index not in by_id[pdo.node].pdos:
            raise DefinitionError(f"{pdo}: the EDS of node {pdo.node} has no {pdo.index:04X}h")
    return files
