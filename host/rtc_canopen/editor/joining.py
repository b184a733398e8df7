"""Joining what two rows of the tree stand for, and ending it."""

from __future__ import annotations

from tickrig.host.rtc_canopen.definition.definition import PdoLink, RtConnection
from tickrig.host.rtc_canopen.editor.system_rows import Item
from tickrig.host.rtc_canopen.errors import ServerRefused
from tickrig.host.rtc_canopen.view import PdoView, PortView, ServerView


def connect(view: ServerView, first: Item, second: Item) -> None:
    """Join two ports through the PC; ServerRefused or RtcRefused if they do not fit."""
    if not (isinstance(first, PortView) and isinstance(second, PortView)):
        raise ServerRefused("through the PC go ports: mark one, go to another")
    out, in_ = (first, second) if first.out else (second, first)
    view.connect(out.name, in_.name)


def link(view: ServerView, first: Item, second: Item) -> None:
    """Link a TPDO with an RPDO, without the PC; ServerRefused if they do not fit."""
    if not (isinstance(first, PdoView) and isinstance(second, PdoView)):
        raise ServerRefused("linked are PDOs: mark one, go to another")
    source, target = sorted((first.name, second.name), key=lambda name: name.pdo[0] != "t")
    if (source.pdo[0], target.pdo[0]) != ("t", "r"):
        raise ServerRefused(f"{source} and {target}: a TPDO is linked with an RPDO")
    view.link(source, target)


def remove(view: ServerView, item: Item) -> None:
    """End a link or connection; ServerRefused if it is none."""
    match item:
        case PdoLink(source, target):
            view.unlink(source, target)
        case RtConnection(first, second):
            view.disconnect(first, second)
        case _:
            raise ServerRefused("links and connections are removed: they are at the end")
