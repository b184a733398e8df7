"""CDR of the RTC data types against omniORB's bytes, round trips and noise."""

from __future__ import annotations

import contextlib
import copy
import pickle
import runpy
import struct
from dataclasses import FrozenInstanceError, replace
from enum import IntEnum
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.errors import FieldError
from tickrig.wire.rtc_types import iis, rtc
from tickrig.wire.rtc_types.cdr import Endian, decode, encode
from tickrig.wire.rtc_types.idl import (
    Char,
    Double,
    Float,
    LongLong,
    Octet,
    Primitive,
    Short,
    String,
    Struct,
    ULong,
    ULongLong,
)
from tickrig.wire.rtc_types.rtc import Time

ROOT = Path(__file__).parents[3]
GOLDEN = ROOT / "tests" / "golden" / "cdr.txt"
TM = Time(1, 2)
VALUES: list[Struct] = [
    rtc.TimedLong(TM, -3),
    rtc.TimedShort(TM, -3),
    rtc.TimedOctet(TM, 7),
    rtc.TimedBoolean(TM, True),
    rtc.TimedDouble(TM, 1.5),
    rtc.TimedFloat(TM, 1.5),
    rtc.TimedString(TM, "ab"),
    rtc.TimedLongSeq(TM, (1, 2)),
    rtc.TimedDoubleSeq(TM, (1.5,)),
    rtc.TimedDoubleSeq(TM, ()),
    rtc.TimedOctetSeq(TM, b"\1\2"),
    rtc.TimedVelocity2D(TM, rtc.Velocity2D(1, 2, 3)),
    rtc.TimedPose2D(TM, rtc.Pose2D(rtc.Point2D(1, 2), 3)),
    rtc.TimedStringSeq(TM, ("a", "bc")),
    rtc.TimedULong(TM, 5),
]
PADDING = {8: range(12, 16), 13: range(18, 20)}
"""Rows and offsets at which omniORB left what was in its buffer."""

TYPES = [
    kind
    for module in (rtc, iis)
    for kind in vars(module).values()
    if isinstance(kind, type) and issubclass(kind, Struct) and kind.__module__ == module.__name__
]


def rows() -> list[tuple[str, Endian, bytes, Struct]]:
    """Return type, byte order, bytes with clean padding, and value of each vector."""
    found = []
    for n, line in enumerate(GOLDEN.read_text("ascii").splitlines()):
        name, _, little, _, big = line.split()
        for endian, text in ((Endian.LITTLE, little), (Endian.BIG, big)):
            found.append((name, endian, bytes.fromhex(text), VALUES[n]))
    return found


ROWS = rows()


@pytest.mark.parametrize(("name", "endian", "data", "value"), ROWS)
def test_bytes_of_omniorb_are_read(name: str, endian: Endian, data: bytes, value: Struct) -> None:
    assert type(value).idl_id() == name
    assert decode(type(value), data, endian) == value


@pytest.mark.parametrize("row", range(len(ROWS)))
def test_the_same_bytes_are_written_with_zeros_as_padding(row: int) -> None:
    _, endian, data, value = ROWS[row]
    expected = bytearray(data)
    for offset in PADDING.get(row // 2, ()):
        expected[offset] = 0
    assert encode(value, endian) == expected


NUMBERS = {
    Primitive.OCTET: (0, 0xFF),
    Primitive.SHORT: (-(2**15), 2**15 - 1),
    Primitive.USHORT: (0, 2**16 - 1),
    Primitive.LONG: (-(2**31), 2**31 - 1),
    Primitive.ULONG: (0, 2**32 - 1),
    Primitive.LONGLONG: (-(2**63), 2**63 - 1),
    Primitive.ULONGLONG: (0, 2**64 - 1),
}
TEXT = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=5)
WIDE = st.text(st.characters(max_codepoint=0xFFFF, exclude_categories=["Cs"]), max_size=3)
NO_MARK = WIDE.filter(lambda text: not text.startswith(("\ufeff", "\ufffe")))
PRIMITIVES: dict[Primitive, st.SearchStrategy[Any]] = {
    **{kind: st.integers(low, high) for kind, (low, high) in NUMBERS.items()},
    Primitive.BOOLEAN: st.booleans(),
    Primitive.CHAR: st.characters(max_codepoint=0xFF),
    Primitive.WCHAR: NO_MARK.filter(lambda text: len(text) == 1),
    Primitive.FLOAT: st.floats(width=32, allow_nan=False),
    Primitive.DOUBLE: st.floats(allow_nan=False),
    Primitive.STRING: TEXT,
    Primitive.WSTRING: NO_MARK,
    Primitive.OCTET_SEQ: st.binary(max_size=5),
}


def values_of(hint: Any) -> st.SearchStrategy[Any]:
    if get_origin(hint) is Annotated:
        return PRIMITIVES[get_args(hint)[1]]
    if get_origin(hint) is tuple:
        return st.lists(values_of(get_args(hint)[0]), max_size=3).map(tuple)
    if issubclass(hint, IntEnum):
        return st.sampled_from(hint)
    hints = get_type_hints(hint, include_extras=True)
    return st.builds(hint, **{name: values_of(hints[name]) for name in hint.__match_args__})


def test_there_are_types_of_all_idl_files() -> None:
    assert len(TYPES) == 138
    assert len({kind.idl_id() for kind in TYPES}) == len(TYPES)


@pytest.mark.parametrize("kind", TYPES, ids=lambda kind: str(kind.idl_id()))
def test_every_type_is_made_without_arguments_and_encoded(kind: type[Struct]) -> None:
    for endian in Endian:
        assert decode(kind, encode(kind(), endian), endian) == kind()


def test_the_types_are_those_of_the_idl() -> None:
    tool = runpy.run_path(str(ROOT / "tools" / "rtc-types"))
    for path, text in tool["generated"]().items():
        assert path.read_text("utf-8") == text, "new: tools/rtc-types"


class Long64(Struct):
    idl_module = "Test"
    mark: Octet = 0
    signed: LongLong = 0
    unsigned: ULongLong = 0


class Nothing(Struct):
    """A struct without fields."""


class Colour(IntEnum):
    RED = 0
    BLUE = 1


class Pixel(Struct):
    """Of a size that is no multiple of its alignment."""

    x: Double = 0.0
    colour: Colour = Colour.RED


class Mixed(Struct):
    """Fields of each kind where the position is known to 8, 4, 2 and 1 bytes."""

    idl_module = "Test"
    octet: Octet = 0
    colour: Colour = Colour.RED
    letters: tuple[Char, ...] = ()
    wide: Double = 0.0
    text: String = ""
    signed: LongLong = 0
    structs: tuple[Long64, ...] = ()
    shorts: tuple[Short, ...] = ()
    short: Short = 0
    doubles: tuple[Double, ...] = ()
    number: ULong = 0
    points: tuple[rtc.Pose2D, ...] = ()
    pixels: tuple[Pixel, ...] = ()
    rows: tuple[tuple[Short, ...], ...] = ()
    colours: tuple[Colour, ...] = ()
    nothing: tuple[Nothing, ...] = ()
    last: Float = 0.0


REFERENCE = {
    Primitive.OCTET: "B",
    Primitive.CHAR: "c",
    Primitive.SHORT: "h",
    Primitive.ULONG: "I",
    Primitive.LONGLONG: "q",
    Primitive.ULONGLONG: "Q",
    Primitive.FLOAT: "f",
    Primitive.DOUBLE: "d",
}


def reference(hint: Any, value: Any, mark: str, out: bytes = b"") -> bytes:
    """Append a value field by field, each one padded to its size."""
    if get_origin(hint) is tuple:
        out = number("I", len(value), mark, out)
        for element in value:
            out = reference(get_args(hint)[0], element, mark, out)
        return out
    if get_origin(hint) is Annotated:
        kind = get_args(hint)[1]
        if kind is Primitive.STRING:
            text = str(value).encode() + b"\0"
            return number("I", len(text), mark, out) + text
        whole = value.encode("latin-1") if kind is Primitive.CHAR else value
        return number(REFERENCE[kind], whole, mark, out)
    if issubclass(hint, IntEnum):
        return number("I", value, mark, out)
    hints = get_type_hints(hint, include_extras=True)
    for name in hint.__match_args__:
        out = reference(hints[name], getattr(value, name), mark, out)
    return out


def number(letter: str, value: object, mark: str, out: bytes) -> bytes:
    data = struct.pack(mark + letter, value)
    return out + bytes(-len(out) % len(data)) + data


@given(st.data(), st.sampled_from(Endian))
def test_each_field_is_padded_to_its_size(data: st.DataObject, endian: Endian) -> None:
    value = data.draw(values_of(Mixed))
    expected = reference(Mixed, value, "<" if endian is Endian.LITTLE else ">")
    assert encode(value, endian) == expected
    assert decode(Mixed, expected, endian) == value


TWO_POSES = encode(iis.TimedPath2DSeq(TM, (), (rtc.Pose2D(), rtc.Pose2D())))
POSES_AT = 16
"""Where their count ends, after the time and the count of `id`; they begin there, too."""


@pytest.mark.parametrize("size", range(POSES_AT + 2, POSES_AT + 48))
def test_a_truncated_sequence_names_the_number_that_is_not_whole(size: int) -> None:
    needed = size // 8 * 8 + 8
    with pytest.raises(FieldError, match=f"^{size} bytes, at least {needed} are needed$"):
        decode(iis.TimedPath2DSeq, TWO_POSES[:size])


@pytest.mark.parametrize(("size", "needed"), [(0, 4), (3, 4), (4, 8), (7, 8), (8, 12), (11, 12)])
def test_a_truncated_run_names_its_first_number_that_is_not_whole(size: int, needed: int) -> None:
    with pytest.raises(FieldError, match=f"^{size} bytes, at least {needed} are needed$"):
        decode(rtc.TimedLong, encode(rtc.TimedLong())[:size])


def test_of_two_faults_the_first_one_is_reported() -> None:
    pixels = encode(Mixed(pixels=(Pixel(), Pixel())))
    at = pixels.index(b"\2\0\0\0") + 8 + 8
    wrong = pixels[:at] + b"\7\0\0\0" + pixels[at + 4 : at + 6]
    with pytest.raises(FieldError, match="7 is not a valid Colour"):
        decode(Mixed, wrong)


@pytest.mark.unmeasured
@given(st.data(), st.sampled_from([*TYPES, Long64, Mixed]), st.sampled_from(Endian))
def test_what_is_encoded_is_decoded_again(
    data: st.DataObject, kind: type[Struct], endian: Endian
) -> None:
    value = data.draw(values_of(kind))
    assert decode(kind, encode(value, endian), endian) == value


@given(st.sampled_from(TYPES), st.binary(max_size=200), st.sampled_from(Endian))
def test_noise_is_a_value_or_a_field_error(
    kind: type[Struct], noise: bytes, endian: Endian
) -> None:
    with contextlib.suppress(FieldError):
        assert isinstance(decode(kind, noise, endian), kind)


@given(st.data(), st.sampled_from(TYPES))
def test_a_truncated_value_is_a_field_error(data: st.DataObject, kind: type[Struct]) -> None:
    whole = encode(data.draw(values_of(kind)))
    with pytest.raises(FieldError):
        decode(kind, whole[: data.draw(st.integers(0, len(whole) - 1))])


def test_a_number_that_an_enumeration_does_not_have_is_a_field_error() -> None:
    whole = bytearray(encode(rtc.GripperState()))
    whole[8:12] = b"\xff\xff\xff\xff"  # behind the time
    with pytest.raises(FieldError):
        decode(rtc.GripperState, bytes(whole))


def test_a_struct_of_64_bit_numbers_is_aligned_to_eight() -> None:
    assert encode(Long64(1, -1, 2)).hex() == "0100000000000000" + "ff" * 8 + "0200000000000000"
    assert Long64.idl_id() == "IDL:Test/Long64:1.0"


def test_a_struct_is_frozen_and_has_slots() -> None:
    value = rtc.TimedLong(TM, 5)
    with pytest.raises(FrozenInstanceError):
        value.data = 6  # type: ignore[misc]  # that is the point
    assert not hasattr(value, "__dict__")
    assert value == rtc.TimedLong(TM, 5)
    other: Struct = rtc.TimedShort(TM, 5)
    assert value != other
    with pytest.raises(FrozenInstanceError):
        del value.data


@pytest.mark.parametrize("value", [*VALUES, rtc.ActArrayState(TM, (rtc.Actuator(1.0),))], ids=repr)
def test_a_struct_has_equal_copies(value: Struct) -> None:
    copies = copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value))
    assert copies == (value,) * 3
    assert {hash(each) for each in copies} == {hash(value)}
    assert {repr(each) for each in copies} == {repr(value)}


def test_a_struct_is_shown_as_the_call_that_makes_it() -> None:
    assert repr(rtc.TimedLong(TM, 5)) == "TimedLong(tm=Time(sec=1, nsec=2), data=5)"


class Later(rtc.TimedLong):
    """A struct with the fields of another one."""

    after: rtc.Time = rtc.Time()


def test_structs_without_fields_are_equal() -> None:
    assert Struct() == Struct()
    assert hash(Struct()) == hash(Struct())


def test_a_struct_has_the_fields_of_its_base_first() -> None:
    assert Later(TM, 5) == Later(TM, 5, rtc.Time())
    assert Later.__match_args__ == ("tm", "data", "after")
    assert decode(Later, encode(Later(TM, 5, TM))) == Later(TM, 5, TM)


def test_iis_types_stand_in_their_own_module() -> None:
    assert iis.TimedPose2D.idl_id() == "IDL:IIS/TimedPose2D:1.0"
    assert rtc.TimedPose2D.idl_id() == "IDL:RTC/TimedPose2D:1.0"


def test_the_fields_of_an_iis_path_are_in_the_order_of_its_idl() -> None:
    path = iis.TimedPath2DSeq(TM, (7,), (rtc.Pose2D(),), (rtc.Velocity2D(1, 0, 0),), (0.5,))
    assert iis.TimedPath2DSeq.__match_args__ == ("tm", "id", "pose", "velocity", "error")
    assert encode(path).hex() == (
        "0100000002000000"  # tm
        "0100000007000000"  # id
        "0100000000000000"  # one pose, padding
        + "00" * 24
        + "0100000000000000"  # one velocity, padding
        + "000000000000f03f"
        + "00" * 16
        + "0100000000000000"  # one error, padding
        + "000000000000e03f"
    )


WRONG: list[Struct] = [
    rtc.TimedLong(TM, 2**31),
    rtc.TimedULong(TM, -1),
    rtc.TimedShort(Time(-1, 0), 0),
    rtc.TimedOctet(TM, 256),
    rtc.TimedFloat(TM, 1e39),
    rtc.TimedChar(TM, "ab"),
    rtc.TimedChar(TM, "あ"),
    rtc.TimedWChar(TM, "\U0001f600"),
    rtc.TimedString(TM, "a\0b"),
    rtc.TimedString(TM, "\ud800"),
    replace(rtc.TimedLong(), data="1"),  # type: ignore[arg-type]  # from untyped code
    replace(rtc.TimedDoubleSeq(), data=1.0),  # type: ignore[arg-type]  # from untyped code
    replace(rtc.GripperState(), status=9),  # type: ignore[arg-type]  # from untyped code
    replace(rtc.TimedPose3D(), data=None),  # type: ignore[arg-type]  # from untyped code
]


@pytest.mark.parametrize("value", WRONG, ids=repr)
def test_a_value_that_does_not_fit_its_type_is_a_field_error(value: Struct) -> None:
    with pytest.raises(FieldError, match=r"is no IDL:RTC/"):
        encode(value)


UNREADABLE: list[tuple[type[Struct], str, str]] = [
    (rtc.TimedLong, "00000000 00000000 00000000 00", "1 too many"),
    (rtc.TimedLong, "00000000 00000000 0000", "12 are needed"),
    (rtc.TimedString, "00000000 00000000 00000000", "NUL"),
    (rtc.TimedString, "00000000 00000000 01000000 61", "NUL"),
    (rtc.TimedString, "00000000 00000000 03000000 610000", "NUL"),
    (rtc.TimedString, "00000000 00000000 02000000 ff00", "text of"),
    (rtc.TimedStringSeq, "00000000 00000000 ffffffff", "announced"),
    (rtc.TimedWChar, "00000000 00000000 00", "UTF-16"),
    (rtc.TimedWChar, "00000000 00000000 04 d83dde00", "UTF-16"),
    (rtc.TimedWString, "00000000 00000000 01000000 61", "text of"),
    (rtc.GripperState, "00000000 00000000 09000000", "GripperStatus"),
]


@pytest.mark.parametrize(("kind", "text", "said"), UNREADABLE)
def test_bytes_that_are_no_value_say_why(kind: type[Struct], text: str, said: str) -> None:
    with pytest.raises(FieldError, match=said):
        decode(kind, bytes.fromhex(text))


@pytest.mark.parametrize("text", ["0061", "feff0061", "fffe6100"])
def test_a_wide_string_is_big_endian_unless_it_says_otherwise(text: str) -> None:
    data = bytes.fromhex(text)
    count = len(data).to_bytes(4, "little")
    assert decode(rtc.TimedWString, bytes(8) + count + data).data == "a"


def test_a_field_that_is_no_idl_type_is_told() -> None:
    class Wrong(Struct):
        data: int = 0

    with pytest.raises(TypeError, match="no IDL type"):
        decode(Wrong, b"")


@pytest.mark.parametrize("now_us", [0, 999_999, 1_000_000, 86_400_000_001])
def test_a_time_stamp_keeps_microseconds(now_us: int) -> None:
    assert Time.from_us(now_us).us == now_us


def test_a_time_stamp_is_seconds_and_nanoseconds() -> None:
    assert Time.from_us(1_500_000) == Time(1, 500_000_000)


def test_a_struct_is_made_by_place_by_name_or_of_zeros() -> None:
    made = rtc.TimedLong(Time(1), data=3)
    assert made == rtc.TimedLong(data=3, tm=Time(sec=1, nsec=0))
    assert replace(made, data=4) == rtc.TimedLong(Time(1), 4)
    assert (rtc.TimedLong(), Nothing()) == (rtc.TimedLong(Time(), 0), Nothing())
    with pytest.raises(TypeError, match="unexpected keyword argument 'late'"):
        rtc.TimedLong(late=1)  # type: ignore[call-arg]
