"""Names of a profile as identifiers of Python and C."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable
from typing import Final

C_KEYWORDS: Final = frozenset(
    (
        *("auto", "bool", "break", "case", "char", "const", "continue", "default", "do", "double"),
        *("else", "enum", "extern", "float", "for", "goto", "if", "inline", "int", "long"),
        *("register", "restrict", "return", "short", "signed", "sizeof", "static", "struct"),
        *("switch", "typedef", "union", "unsigned", "void", "volatile", "while"),
        *("delete", "new", "operator", "private", "public", "template", "this", "throw", "virtual"),
    )
)
"""Words that C keeps for itself, and those of C++ that somebody might call a port."""

COMPONENT_NAMES: Final = frozenset(
    (
        *("category", "error_check", "inputs", "on_aborting", "on_activated", "on_deactivated"),
        *("on_error", "on_execute", "on_finalize", "on_initialize", "on_reset", "physical"),
        *("ports", "product_code", "profile", "rate_hz", "strict_cia301", "type_name"),
        *("vendor", "version"),
    )
)
"""What a component has beside its ports."""

IMPORTED: Final = frozenset(("CanopenInPort", "CanopenOutPort", "PortTransport", "integer"))
"""What the skeleton uses while it declares ports, beside the types."""


def python_name(name: str) -> str:
    """Return an attribute of a component; a name that is taken, or a constant, gets an underscore.

    >>> python_name("in"), python_name("target_um")
    ('in_', 'target_um')
    """
    taken = keyword.iskeyword(name) or name in COMPONENT_NAMES | IMPORTED or name.isupper()
    return f"{name}_" if taken else name


def c_name(name: str) -> str:
    """Return a member of a struct in C."""
    return f"{name}_" if name in C_KEYWORDS else name


def snake_name(name: str) -> str:
    """Return a name in lower case, as files and constants want it.

    >>> snake_name("UnsignedLongLong"), snake_name("Gripper2")
    ('unsigned_long_long', 'gripper2')
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def check_identifiers(type_name: str, ports: Iterable[str]) -> None:
    """Raise ValueError if a name cannot be written down in Python and C."""
    if keyword.iskeyword(type_name):
        raise ValueError(f"name {type_name!r} is a keyword of Python")
    names = set(ports)
    for name in sorted(names):
        for other in (python_name(name), c_name(name)):
            if other != name and other in names:
                raise ValueError(f"port {name!r} becomes {other!r}, and so is another called")
