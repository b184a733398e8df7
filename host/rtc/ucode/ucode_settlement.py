"""UcodeSettlement, which resolves a ucode to the address of its information."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Final

from tickrig.host.rtc.component import ModuleSpec
from tickrig.host.rtc.ports.data_port import OutPort
from tickrig.host.rtc.ucode.cache import LookupCache, OpenSource
from tickrig.host.rtc.ucode.http_source import HttpSource
from tickrig.host.rtc.ucode.lookup import Lookup, WantedUcode
from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types.rtc import TimedStringSeq
from tickrig.wire.ucode import parse_ucode

_SERVICE: Final = "http://127.0.0.1:8640"
_MOST_CHARACTERS: Final = 1_000
"""Maximum number of characters of an address."""


class UcodeSettlement(Lookup[str]):
    """Component that asks a service for the address of the information about a ucode.

    The in-port is `ucodes`, and the out-port is `addresses`. A value of `addresses` contains each
    ucode followed by its address. To find an address, the component reads the URL
    `SERVICE/ucodes/UCODE`. `SERVICE` is the URL in the configuration parameter `service`, and
    `UCODE` is the ucode. The answer is the address as text. Invalid ucodes are counted in
    `invalid_ucodes`. The NEDO report (Fig. 123) only names the component and its cache. tickrig has
    defined the rest.

    Args:
        instance_name: name of the component.
        open_source: function that creates the client of the service. By default, it is an HTTP
            client.

    Attributes:
        invalid_ucodes: number of invalid ucodes that arrived.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("UcodeSettlement", "Addresses of ucodes, cached")

    def __init__(self, instance_name: str, open_source: OpenSource = HttpSource) -> None:
        super().__init__(instance_name, "ucodes", LookupCache(parse_address), open_source)
        self._service = self.configuration.bind("service", _SERVICE)
        self.addresses = self.add_port(OutPort("addresses", TimedStringSeq))
        self._add_outputs()
        self.invalid_ucodes = 0

    def _wanted(self, value: TimedStringSeq) -> Iterator[WantedUcode]:
        service = self._service.value.rstrip("/")
        for word in value.data:
            try:
                ucode = parse_ucode(word)
            except FieldError:
                self.invalid_ucodes += 1
            else:
                yield WantedUcode(ucode, f"{service}/ucodes/{ucode}", value.tm)

    def _write(self, found: list[tuple[WantedUcode, str]]) -> None:
        words = (word for wanted, address in found for word in (wanted.ucode, address))
        self.addresses.write(TimedStringSeq(found[0][0].received, tuple(words)))


def parse_address(text: str) -> str:
    """Return the `http://` address that the answer of the ucode service contains.

    Raises:
        ValueError: the text is not such an address.
    """
    address = text.strip()
    if not address.startswith("http://") or len(address) > _MOST_CHARACTERS:
        raise ValueError(f"{address[:60]!r} is no address, http://...")
    return address
