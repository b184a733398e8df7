"""The table of a resolution service, and what it answers."""

from __future__ import annotations

import pytest

from tickrig.emulators.tkernel.resolution import ResolutionService
from tickrig.emulators.tkernel.ucode_table import EXAMPLE, UcodeTable, parse_table

DOOR = "00001C00000000000001000000000001"
BASE = "http://127.0.0.1:8640"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[ucode]", "line 1: no key 'ucode'; did you mean 'ucodes'?"),
        ("ucodes = 1", "line 1: ucodes: it is a table [ucodes], not 1"),
        ("[ucodes]\n1 = 'a'", "line 2: ucodes.1: ucode '1' is not 32 hex digits"),
        (f"[ucodes]\n{DOOR} = 'lift'", f"ucodes.{DOOR}: 'lift' is no name of contents and no http"),
        ("[contents.door]\nx_m = 1", "contents.door: y_m is a number of metres, not null"),
        ("[contents.'a/b']\nx_m = 1\ny_m = 1", 'contents."a/b": a name has letters, digits'),
        ("[contents.door]\nx_m = 1\ny_m = 1\nd = 2026-01-01", "contents.door: Object of type"),
        ("[ucodes", "line 1: ']' is missing behind ucodes"),
    ],
)
def test_a_table_that_cannot_be_is_told_in_a_line(text: str, told: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the text follows
        parse_table(text)
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_empty_table_knows_nothing() -> None:
    assert parse_table("") == UcodeTable()


def test_a_ucode_may_have_an_address_elsewhere() -> None:
    table = parse_table(f"[ucodes]\n{DOOR.lower()} = 'http://127.0.0.1:80/a'")
    service = ResolutionService(table, BASE)
    assert service.respond(f"/ucodes/{DOOR}").text == "http://127.0.0.1:80/a"


def test_each_fault_has_its_answer() -> None:
    service = ResolutionService(parse_table(EXAMPLE), BASE)
    path = f"/ucodes/{DOOR.lower()}"
    good = service.respond(path)
    assert (good.status, good.text, good.delay_us) == (200, f"{BASE}/contents/door", 0)
    service.inputs.set("slow", 1)
    assert service.respond(path).delay_us == 3_000_000
    service.inputs.set("broken", 1)
    assert service.respond(path).text == "out of order"
    service.inputs.set("unknown_ucode", 1)
    assert service.respond(path).status == 404
    assert [service.read(name) for name in service.outputs] == [4, 3, 1]
    service.inputs.set("unreachable", 1)
    assert not service.reachable
