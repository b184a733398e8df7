"""EDS files of a folder, chosen by the identity of a node (1018h).

>>> node_identity([0xFB, 0x65, None])
EdsIdentity(vendor=251, product=101, revision=None)
>>> str(node_identity([0xFB, 0x65, 0x20001]))
'vendor 000000FBh, product 00000065h, revision 00020001h'
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.node_memory import EdsObjects, read_eds_objects
from tickrig.host.canopen.eds import read_eds_bytes
from tickrig.host.text.page_text import one_line
from tickrig.wire.canopen.eds.eds_file import EdsError, EdsFile, decode_text

# Theory of operation
# ===================
#
# A folder of a vendor holds hundreds of files, so `EdsFolder` reads only the identity from each:
# the sections DeviceInfo, DeviceComissioning and 1018h of an EDS or DCF; an XDD is parsed
# whole. It does so at the first search for a node. A file that cannot be read, or has neither
# vendor nor product, fits no node.
#
# A file fits a node if vendor and product are equal. Among those that fit, in this order: the
# revision (equal; the same major half, which CiA 301 changes with the CANopen behaviour; not in
# the file; another one), then the kind (a DCF of this node-ID has its real values; a DCF of another
# node has values of that node), then the nearest revision, then the name.
#
# A decoder gets `EdsFiles`: files by node-ID, as `--eds` names them, which always count, and the
# folder. A decoder calls it whenever it learns a part of 1018h, so a file is chosen by vendor and
# product, and may change when the revision comes.

_ENDINGS: Final = (".eds", ".dcf", ".xdd", ".xdc")
_SECTIONS: Final = re.compile(
    r"^[ \t]*\[[ \t]*(?:DeviceInfo|DeviceComissioning|1018sub[123])[ \t]*\][^\[]*",
    re.IGNORECASE | re.MULTILINE,
)
_KEYS: Final = ("VendorNumber", "ProductNumber", "RevisionNumber")
_MAJOR: Final = 16
"""Number of bits of the revision number below its major half."""


class EdsIdentity(NamedTuple):
    """Identity of a device (1018h), by which the EDS file for a node is chosen.

    Attributes:
        vendor: vendor-ID (object 1018h:01).
        product: product code (object 1018h:02).
        revision: revision number (object 1018h:03), or None if it is unknown.
    """

    vendor: int
    product: int
    revision: int | None = None

    def __str__(self) -> str:
        text = f"vendor {self.vendor:08X}h, product {self.product:08X}h"
        return text if self.revision is None else f"{text}, revision {self.revision:08X}h"


def node_identity(values: Sequence[int | None]) -> EdsIdentity | None:
    """Return the identity of a node from the values of 1018h that it sent.

    The result is None if vendor or product is unknown, because no EDS file can then be chosen.

    Args:
        values: vendor-ID, product code and revision number (1018h:01 to 03), each None if unknown.
    """
    vendor, product, revision = values
    return None if vendor is None or product is None else EdsIdentity(vendor, product, revision)


class _EdsChoice(NamedTuple):
    """The chosen file of a node.

    Attributes:
        path: path of the file.
        text: text for the user that contains the chosen file, the reason, and other files that fit.
    """

    path: Path
    text: str

    def said(self, node: int) -> str:
        """Return the line for the user."""
        return f"node {node}: EDS {self.text}"


class _Candidate(NamedTuple):
    path: Path
    identity: EdsIdentity
    node: int | None  # of a DCF

    def rank(self, wanted: EdsIdentity, node: int) -> tuple[int, int, int, str]:
        """Return how well a file fits a node. A smaller rank is better."""
        revision, asked = self.identity.revision, wanted.revision
        kind = 1 if self.node is None else 0 if self.node == node else 2
        if revision is None or asked is None:
            return 2 if revision is None else 0, kind, -(revision or 0), str(self.path)
        level = 0 if revision == asked else 1 if revision >> _MAJOR == asked >> _MAJOR else 3
        return level, kind, abs(revision - asked), str(self.path)


_REVISIONS: Final = {
    0: "it has the revision of the node",
    1: "it has the major revision of the node",
    2: "it has no revision, the other has a wrong one",
    3: "its revision is the nearest",
}


class EdsFolder:
    """The EDS files of some folders.

    Args:
        folders: paths of existing folders.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        self.folders = tuple(folders)
        self._candidates: list[_Candidate] | None = None

    def choose(self, node: int, wanted: EdsIdentity) -> _EdsChoice | None:
        """Return the file for a node, or None if no file fits."""
        if self._candidates is None:
            self._candidates = list(self._read())
        fitting = sorted(
            (one for one in self._candidates if one.identity[:2] == wanted[:2]),
            key=lambda one: one.rank(wanted, node),
        )
        if not fitting:
            return None
        best, *others = fitting
        text = f"{best.path} ({wanted})"
        revision = best.identity.revision
        if revision is not None and wanted.revision not in (None, revision):
            text += f"; it is of revision {revision:08X}h"
        if others:
            names = ", ".join(str(one.path) for one in others)
            text += f"; also fits: {names}; preferred: {_reason(best, others[0], wanted, node)}"
        return _EdsChoice(best.path, one_line(text))

    def __str__(self) -> str:
        return ", ".join(map(str, self.folders))

    def _read(self) -> Iterator[_Candidate]:
        for folder in self.folders:
            for path in sorted(folder.iterdir()):
                if path.suffix.lower() in _ENDINGS and path.is_file():
                    try:
                        found = _candidate(path)
                    except (OSError, EdsError):
                        continue
                    if found is not None:
                        yield found


def _reason(best: _Candidate, other: _Candidate, wanted: EdsIdentity, node: int) -> str:
    """Return why a file fits better than the next one."""
    first, second = best.rank(wanted, node), other.rank(wanted, node)
    if first[0] != second[0]:
        return _REVISIONS[first[0]]
    if first[1] != second[1]:
        return f"it is the DCF of node {node}" if best.node == node else "the other is of a node"
    if wanted.revision is None and first[2] != second[2]:
        return "it has the latest revision; that of the node is unknown"
    return _REVISIONS[3] if first[2] != second[2] else "first by name"


def _candidate(path: Path) -> _Candidate | None:
    """Return the identity that a file is for, or None if the file contains none."""
    text = decode_text(read_eds_bytes(path))
    if path.suffix.lower() in _ENDINGS[:2]:
        text = "\n".join(match[0] for match in _SECTIONS.finditer(text))
    file = EdsFile(str(path), text)
    told = [
        file.number("DeviceInfo", key) or file.number(f"1018sub{sub}", "DefaultValue")
        for sub, key in enumerate(_KEYS, 1)
    ]
    if not (told[0] or told[1]):
        return None
    has_revision = file.value("DeviceInfo", _KEYS[2]) or file.value("1018sub3", "DefaultValue")
    identity = EdsIdentity(told[0], told[1], told[2] if has_revision else None)
    node = file.number("DeviceComissioning", "NodeID")
    return _Candidate(path, identity, node or None)


class EdsFiles(dict[int, EdsObjects]):
    """Contents of the EDS files of all nodes, as a dictionary by node-ID.

    If a node without a file reports its identity (1018h), a file for it is chosen from a folder,
    and added to the dictionary.

    Args:
        given: contents of the files that the user has assigned to nodes. No other file is chosen
            for these nodes.
        folder: folder from which the files of other nodes are chosen, or None for no folder.
        notify: function that is called with a message about each choice.

    Attributes:
        folder: folder from which the files of other nodes are chosen, or None for no folder.
    """

    def __init__(
        self,
        given: Mapping[int, EdsObjects] | None = None,
        folder: EdsFolder | None = None,
        notify: Callable[[str], None] = lambda text: None,
    ) -> None:
        super().__init__(given or {})
        self.folder, self.notify = folder, notify
        self._given = frozenset(self)
        self._said: dict[tuple[str, int], tuple[Path | None, str]] = {}

    def find(self, channel: str, node: int, identity: EdsIdentity) -> EdsObjects | None:
        """Choose the EDS file for a node by its identity, and return the content of the file.

        The result is None in these cases: no file fits, the file cannot be read, an earlier call
        has already returned the same file for this node, or the user has assigned a file to the
        node.

        Args:
            channel: name of the bus.
            node: node-ID of the node.
            identity: identity that the node has reported (1018h).
        """
        if self.folder is None or node in self._given:
            return None
        choice = self.folder.choose(node, identity)
        no_eds = f"node {node}: no EDS in {self.folder} for {identity}"
        text = one_line(no_eds) if choice is None else choice.said(node)
        path = None if choice is None else choice.path
        before = self._said.get((channel, node))
        settled = before is not None and before[0] == path
        if settled and ("; " not in text or before == (path, text)):
            return None  # the revision, which came after vendor and product, changes nothing
        self._said[channel, node] = path, text
        self.notify(text)
        if path is None or settled:
            return None
        try:
            found = read_eds_objects(path, node)
        except (OSError, EdsError) as error:
            self.notify(one_line(f"node {node}: {error}"))
            return None
        self[node] = found
        return found
