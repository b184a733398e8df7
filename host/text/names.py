"""Suggestions for misspelt names, in one short line."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

_MOST: Final = 40
SHOWN: Final = 8
_LONGEST: Final = 200
"""Length of the longest name for suggestions."""
_NUMBER: Final = re.compile(r"0x[0-9a-f]+|\d+")


def known(names: Iterable[str]) -> str:
    """Return names as one text for an error message, separated by commas.

    A long list is cut, and the total number of names is added.

    >>> known(["stick", "lamp"])
    'stick, lamp'
    """
    everything = list(names)
    if len(everything) <= _MOST:
        return ", ".join(everything)
    return ", ".join(everything[:SHOWN]) + f", ... ({len(everything)} in all)"


def near(name: str, names: Iterable[str]) -> str:
    """Suggest the name that was probably meant, or list the known names.

    >>> near("stik", ["stick", "lamp"]), near("x", ["stick", "lamp"])
    ("did you mean 'stick'?", 'known: stick, lamp')
    >>> near("left/x", ["left/stick", "right/lamp", "left/stick"])
    'known: left/stick'
    """
    names, device = list(dict.fromkeys(names)), "".join(name.rpartition("/")[:2])
    if close := closest(name, names):
        return f"did you mean {close[0]!r}?"
    own = [each for each in names if device and each.startswith(device)]
    return f"known: {known(own or names) or 'none'}"


def closest(name: str, names: Iterable[str]) -> list[str]:
    """Return a list with the known name that is most similar to a misspelled one.

    The list is empty if no name is similar. Case is ignored. If two names differ only in their
    numbers, they are not similar.

    >>> closest("EPOS", ["epos", "rrc"]), closest("stik", ["left/stick", "right/stick"])
    (['epos'], ['left/stick'])
    >>> closest("0x5000", ["0x2000", "3/0x5000"]), closest("0x5000", ["0x2000"])
    (['3/0x5000'], [])
    >>> closest("rh3", ["rrc", "rh3-base"]), closest("rtc", ["rtc-lite", "rtc-echo"])
    (['rh3-base'], [])
    >>> closest("left/speed_rpm", ["left/load_nm"]), closest("left/lod_nm", ["left/load_nm"])
    ([], ['left/load_nm'])
    """
    from difflib import get_close_matches  # noqa: PLC0415 - only for mistakes

    if len(name) > _LONGEST:
        return []
    names, (device, slash, signal) = list(names), name.rpartition("/")
    own = [each.removeprefix(device + slash) for each in names if each.startswith(device + slash)]
    if slash and own:  # a device that there is
        return [f"{device}/{each}" for each in closest(signal, own)]
    alike: dict[str, str] = {}
    for each in names:
        alike.setdefault(each.casefold(), each)
    for each in names:  # of a device that was not said
        alike.setdefault(each.rpartition("/")[2].casefold(), each)
    wanted = name.casefold()
    meant = [each for each in alike if not _is_another(wanted, each)]
    begun = [each for each in meant if re.match(r"[-_]", each.removeprefix(wanted))]
    if len(begun) == 1 and wanted:
        return [alike[begun[0]]]
    return [alike[each] for each in get_close_matches(wanted, meant, n=1)]


def _is_another(wanted: str, name: str) -> bool:
    """Return whether a name differs in its numbers, however similar it looks."""
    form = _NUMBER.sub("#", wanted)
    if any(map(str.isalpha, form)):
        return wanted != name and form == _NUMBER.sub("#", name)
    return not set(_NUMBER.findall(wanted)) <= set(_NUMBER.findall(name))
