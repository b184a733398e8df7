"""Names in place of numbers: what stands for `$heartbeat` or `$rw_u8.new` on this node."""

from __future__ import annotations

import re
from typing import Final, Protocol

NAME: Final = re.compile(r"\$(?:\{([a-z][a-z0-9_]*)\}|([a-z][a-z0-9_]*)(?:\.([a-z]+))?)")
"""`$name`, `$name.attribute`, or `${name}` where a digit follows."""
ADDRESS: Final = re.compile(r"([0-9A-F]{4}):([0-9A-F]{2})")

Address = tuple[int, int]
"""Index and sub-index."""


class Unbound(Exception):  # noqa: N818 - what the name is
    """A name for which this node has nothing.

    Attributes:
        reason: why, for people.
    """

    def __init__(self, name: str, reason: str) -> None:
        super().__init__(f"${name}: {reason}")
        self.reason = reason


class Names(Protocol):
    """What stands for the names in checks on one node."""

    def text(self, name: str, attribute: str, /) -> str:
        """Return what stands for `$name.attribute`; the attribute may be empty.

        Of an object: its multiplexer in hex as an SDO carries it; `new` and `other`, two allowed
        values, `old`, the one before the run, `map`, its mapping entry; all in hex as they go
        over the bus.

        Raises:
            Unbound: the node has nothing of the kind.
        """
        ...

    def address(self, name: str, /) -> Address:
        """Return index and sub-index of an object; Unbound if there is none."""
        ...


def resolve(text: str, names: Names) -> str:
    """Replace all names in a text; Unbound if one has nothing."""
    if "$" not in text:
        return text
    return NAME.sub(lambda match: names.text(match[1] or match[2], match[3] or ""), text)


def resolve_address(target: str, names: Names) -> Address:
    """Return the address of `$name`, `1017:00` or `$tpdo.comm:01`."""
    match = NAME.fullmatch(target)
    if match is not None and not match[3]:
        return names.address(match[1] or match[2])
    match = ADDRESS.fullmatch(resolve(target, names))
    if match is None:
        raise ValueError(f"{target!r} is no object like 1017:00 or $rw_u8")
    return int(match[1], 16), int(match[2], 16)
