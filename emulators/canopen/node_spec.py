"""Node specifications of command lines."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.emulators.canopen.choices import LSS, MODELS
from tickrig.host.text.user_file import SUFFIX

_IDS: Final = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?")


@dataclass(frozen=True, slots=True)
class NodeSpec:
    """A CANopen node to be emulated, as specified on the command line by `--node`.

    Attributes:
        device: EDS or DCF of the node, name of a model, or `FILE.py:Class` of a DeviceRTC.
        node_id: node-ID 1..127, or `UNCONFIGURED`, or None to use the node-ID of the DCF or model.
        profile: name of the node's profile, one of `choices.PROFILES`. None means the profile that
            the option `--profile` gives for all nodes.
    """

    device: Path | str
    node_id: int | None
    profile: str | None = None


def parse_node(text: str) -> Iterator[NodeSpec]:
    """Yield the CANopen nodes that a user specifies with an option `--node`.

    The text has one of the forms `5=a.eds`, `1-20=a.eds`, `5=epos`, `5=a.py:Class`, `lss=a.eds` and
    `a.dcf`. A name such as `epos` means the model, unless a file of this name exists.

    Raises:
        ValueError: the text has another form.

    >>> [spec.node_id for spec in parse_node("5-7=a.eds")]
    [5, 6, 7]
    """
    ids, equals, name = text.partition("=")
    if not equals:
        yield NodeSpec(_device(text), None)
        return
    if not name:
        raise ValueError(f"--node {text}: give ID=FILE or ID=MODEL, as 5=a.eds")
    for node_id in parse_ids(f"--node {text}", ids):
        yield NodeSpec(_device(name), node_id)


def parse_ids(what: str, text: str) -> Iterable[int]:
    """Read a node-ID, a range of node-IDs, or `lss`."""
    if text == LSS:
        return (UNCONFIGURED,)
    match = _IDS.fullmatch(text)
    first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
    if not 1 <= first <= last <= 127:
        raise ValueError(
            f"{what}: a node-ID is 1..127, a range as 1-20, or {LSS} for a node that waits for LSS"
        )
    return range(first, last + 1)


def _device(name: str) -> Path | str:
    if f"{SUFFIX}:" in name:
        return name
    file = Path(name)
    return name if name in MODELS and not file.exists() else file
