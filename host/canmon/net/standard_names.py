"""Names of CiA 301 as an EDS writes them in full, for nodes of which there is none."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final

from tickrig.host.canmon.model.decode.object_text import slug
from tickrig.wire.canopen.eds.communication_profile import (
    OFF,
    CommunicationProfile,
    Pdo,
    add_communication,
)
from tickrig.wire.canopen.eds.object_table import ObjectCode, ObjectTable

PDOS: Final = 64
"""PDOs of each direction that have names."""


@cache
def standard_names() -> Mapping[str, tuple[int, int]]:
    """Return index and sub-index of the communication objects by their names.

    >>> standard_names()["identity_object.product_code"] == (0x1018, 2)
    True
    """
    table, pdos = ObjectTable(), [Pdo(OFF)] * PDOS
    profile = CommunicationProfile(
        device_type=0, name="", hardware="", software="", product_code=0, rpdos=pdos, tpdos=pdos
    )
    add_communication(table, profile)
    found: dict[str, tuple[int, int]] = {}
    for row in table:
        head = table.objects[row.index]
        whole = "" if head.code is ObjectCode.VAR else f"{slug(head.name)}."
        found[f"{whole}{slug(row.name)}"] = row.index, row.sub
    return found
