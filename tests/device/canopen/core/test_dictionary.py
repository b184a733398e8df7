from __future__ import annotations

import pytest

from tickrig.device.canopen.dictionary import Dictionary, Entry, SdoAbort
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode


def make(index: int, sub: int = 0) -> EntryDescription:
    return EntryDescription(index, sub, "x", DataType.UNSIGNED8, Access.READ)


def test_two_entries_at_one_place_are_refused() -> None:
    with pytest.raises(ValueError, match=r"<2000h:01 x> is in the dictionary twice"):
        Dictionary([make(0x2000, 1), make(0x2000), make(0x2000, 1)])


def test_a_missing_entry_is_told_by_its_place() -> None:
    dictionary = Dictionary([make(0x2000)])
    assert (0x2000, 0) in dictionary
    with pytest.raises(KeyError, match=r"2000h:01 is not in the dictionary"):
        dictionary[0x2000, 1]


def test_elements_end_at_a_gap() -> None:
    dictionary = Dictionary([make(0x2000, sub) for sub in (0, 1, 2, 4)])
    assert [entry.sub for entry in dictionary.elements(0x2000)] == [1, 2]
    assert [entry.sub for entry in dictionary.elements(0x2000, most=1)] == [1]


def test_a_dictionary_has_as_many_entries_as_were_described() -> None:
    assert len(Dictionary([make(0x2000), make(0x2001)])) == 2


def test_an_owner_judges_a_value_before_it_is_there() -> None:
    entry = Dictionary([make(0x2000)])[0x2000, 0]
    entry.check_owner(b"\x07")

    def guard(entry: Entry, value: Value) -> None:
        raise SdoAbort(AbortCode.LOCAL_CONTROL)

    entry.guard = guard
    with pytest.raises(SdoAbort, match="LOCAL_CONTROL"):
        entry.check_owner(b"\x07")
    assert entry.value == 0


@pytest.mark.parametrize(
    ("kind", "data", "number"),
    [
        (DataType.INTEGER32, "FFFFFF7F", 0x7FFF_FFFF),
        (DataType.INTEGER32, "00000080", -0x8000_0000),
        (DataType.INTEGER32, "FEFFFFFF", -2),
        (DataType.UNSIGNED32, "FEFFFFFF", 0xFFFF_FFFE),
        (DataType.UNSIGNED32, "01020304", 0x0403_0201),
        (DataType.INTEGER16, "FEFF", -2),
        (DataType.UNSIGNED64, "FEFFFFFFFFFFFFFF", 0xFFFF_FFFF_FFFF_FFFE),
    ],
)
def test_the_number_of_an_entry_has_the_sign_of_its_type(
    kind: DataType, data: str, number: int
) -> None:
    entry = Dictionary([EntryDescription(0x2000, 0, "x", kind, Access.READ)])[0x2000, 0]
    entry.assign(bytes.fromhex(data))
    assert entry.number == number == entry.value
