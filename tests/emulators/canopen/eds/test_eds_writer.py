from __future__ import annotations

from inspect import getmembers, isdatadescriptor
from pathlib import Path

import pytest
from canopen.objectdictionary import import_od
from hypothesis import given
from hypothesis import strategies as st

from tests.device.canopen.reference import make_dictionary
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.canopen.eds import describe, read_eds
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.eds_writer import write_dcf, write_eds
from tickrig.wire.canopen.eds.object_table import (
    Access,
    DeviceInfo,
    EntryDescription,
    ObjectCode,
    ObjectDescription,
)

R1_EDS = Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds"
SAMPLE = Path(__file__).parent / "sample.dcf"
R1_INFO = DeviceInfo(
    vendor_name="tickrig",
    product_name="reference slave R1",
    bit_rates=frozenset(1_000 * kbit for kbit in (10, 20, 50, 125, 250, 500, 800, 1000)),
)

ACCESS = st.sampled_from(
    [
        Access.from_eds(name, mappable=mappable)
        for name in ("ro", "wo", "rw", "rwr", "rww", "const")
        for mappable in (False, True)
    ]
)
NAMES = st.text(st.characters(exclude_categories=["C", "Z"]), max_size=8)


def rows(dictionary: Dictionary) -> list[tuple[object, ...]]:
    names = [name for name, _ in getmembers(EntryDescription, isdatadescriptor)]
    described = [name for name in names if name[0] != "_" and name != "has_default"]
    return [tuple(getattr(entry, name) for name in described) for entry in dictionary.description]


def read_again(text: str) -> Dictionary:
    return describe(EdsFile("again.eds", text)).template


@st.composite
def limits(draw: st.DrawFn, kind: DataType) -> list[float | None]:
    if kind in (DataType.REAL32, DataType.REAL64):
        numbers: st.SearchStrategy[float] = st.floats(allow_nan=False)
    elif kind.is_integer:
        least = -(1 << kind.bits - 1) if kind.signed else 0
        numbers = st.integers(least, least + (1 << kind.bits) - 1)
    else:
        return [None, None]
    both = draw(st.tuples(numbers, numbers).map(sorted))
    return [limit if draw(st.booleans()) else None for limit in both]


@st.composite
def entries(draw: st.DrawFn, index: int, sub: int) -> EntryDescription:
    kind = draw(st.sampled_from(list(DataType)))
    low, high = draw(limits(kind))
    relative = kind.is_integer and not kind.signed and kind.size > 1 and draw(st.booleans())
    entry = EntryDescription(
        *(index, sub, draw(NAMES), kind, draw(ACCESS)),
        low=low,
        high=high,
        relative=relative,
        max_bytes=draw(st.integers(1, 100_000)),
    )
    size = kind.size or draw(st.integers(0, 12))
    texts = st.text(max_size=size).map(lambda text: text.encode("utf-16-le"))
    data = draw(
        texts if kind is DataType.UNICODE_STRING else st.binary(min_size=size, max_size=size)
    )
    if kind is DataType.BOOLEAN:
        data = bytes([data[0] & 1])
    entry.default = data
    return entry


@st.composite
def dictionaries(draw: st.DrawFn) -> Dictionary:
    found, infos = [], {}
    for index in draw(st.sets(st.integers(0x1000, 0xFFFF), min_size=1, max_size=4)):
        code = draw(st.sampled_from([ObjectCode.VAR, ObjectCode.ARRAY, ObjectCode.RECORD]))
        subs = (
            {0}
            if code is ObjectCode.VAR
            else draw(st.sets(st.integers(0, 254), min_size=1, max_size=3))
        )
        found += [draw(entries(index, sub)) for sub in subs]
        infos[index] = ObjectDescription(
            found[-1].name if code is ObjectCode.VAR else draw(NAMES), code
        )
    return Dictionary(found, infos)


@given(dictionaries())
def test_what_is_written_is_read_again_without_loss(dictionary: Dictionary) -> None:
    again = read_again(write_eds(dictionary.description))
    assert rows(again) == rows(dictionary)
    assert again.objects == dictionary.objects


def test_the_eds_of_r1_is_r1() -> None:
    description = read_eds(R1_EDS)
    assert rows(description.template) == rows(make_dictionary())
    assert description.info == R1_INFO
    assert write_eds(make_dictionary().description, R1_INFO) == R1_EDS.read_text()


def test_an_eds_of_others_survives_writing() -> None:
    sample = read_eds(SAMPLE)
    again = describe(EdsFile("again.eds", write_eds(sample.template.description, sample.info)))
    assert rows(again.template) == rows(sample.template)
    assert again.info == sample.info


def test_the_canopen_library_reads_what_is_written() -> None:
    found = import_od(str(R1_EDS), 5)
    cob_id = found.get_variable(0x1800, 1)
    assert cob_id is not None
    assert cob_id.default == 0x4000_0185
    assert found[0x1017].name == "Producer heartbeat time"


def test_a_dcf_holds_present_values() -> None:
    dictionary = make_dictionary()
    dictionary[0x1017, 0].value = 100
    dictionary[0x2007, 0].value = "a value\n"
    values = {entry.key: entry.data for entry in dictionary}
    text = write_dcf(dictionary.description, 7, 250_000, values)
    again = describe(EdsFile("again.dcf", text))
    assert (again.node_id, again.bit_rate) == (7, 250_000)
    assert again.template[0x1017, 0].value == 100
    assert "\nParameterValue=\n" in text


def test_an_object_of_several_entries_is_no_variable() -> None:
    u8 = DataType.UNSIGNED8
    dictionary = Dictionary([EntryDescription(0x2000, sub, "x", u8, Access.READ) for sub in (0, 1)])
    again = read_again(write_eds(dictionary.description))
    assert again.objects[0x2000] == ObjectDescription("x", ObjectCode.RECORD)


@pytest.mark.parametrize("name", ["two\nlines", " blank", "a ;comment"])
def test_a_name_that_an_eds_cannot_hold_is_refused(name: str) -> None:
    entry = EntryDescription(0x2000, 0, name, DataType.UNSIGNED8, Access.READ)
    with pytest.raises(ValueError, match="an EDS cannot hold the name"):
        write_eds(Dictionary([entry]).description)


@pytest.mark.parametrize("access", [Access.NONE, Access.READ | Access.RPDO])
def test_an_access_that_an_eds_cannot_express_is_refused(access: Access) -> None:
    entry = EntryDescription(0x2000, 0, "x", DataType.UNSIGNED8, access)
    with pytest.raises(ValueError, match=r"an EDS cannot express the access of 2000h:00 x: "):
        write_eds(Dictionary([entry]).description)
