from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.model.decode.node_memory import ObjectText
from tickrig.host.canmon.model.node_dictionary import encode_value
from tickrig.wire.canopen.datatypes import DataType


@pytest.mark.parametrize(
    ("text", "words", "data"),
    [
        (ObjectText("word", DataType.UNSIGNED16, in_hex=True), "0x1F", "1f00"),
        (ObjectText("mode", DataType.INTEGER8), "-1", "ff"),
        (ObjectText("on", DataType.BOOLEAN), "true", "01"),
        (ObjectText("gain", DataType.REAL32), "1.5", "0000c03f"),
        (ObjectText("gain", DataType.REAL32), "2", "00000040"),
        (ObjectText("angle", DataType.INTEGER16, "deg", 0.1), "-1.5", "f1ff"),
        (ObjectText("name", DataType.VISIBLE_STRING), "a b", "612062"),
        (ObjectText("blob", DataType.DOMAIN), "01 ff", "01ff"),
        (ObjectText("blob", DataType.DOMAIN), "", ""),
        (ObjectText(), "3702", "3702"),
    ],
)
def test_a_value_is_written_as_it_is_read(text: ObjectText, words: str, data: str) -> None:
    assert encode_value(text, words).hex() == data


@pytest.mark.parametrize(
    ("text", "words", "refusal"),
    [
        (ObjectText("mode", DataType.INTEGER8), "fast", "'fast' is no number; mode is INTEGER8"),
        (ObjectText("mode", DataType.INTEGER8), "200", "200 is not in the range of INTEGER8"),
        (ObjectText("mode", DataType.INTEGER8), "1.5", "1.5 is not in the range of INTEGER8"),
        (ObjectText("angle", DataType.INTEGER8, "deg", 0.1), "99", "99 is not in the range"),
        (ObjectText("angle", DataType.INTEGER8, "deg", 0.1), "inf", "is no number"),
        (ObjectText("gain", DataType.REAL32), "1e99", "1e99 is not in the range of REAL32"),
        (ObjectText(), "12 3", "'12 3' is not bytes in hex, as 37 02"),
        (ObjectText("text", DataType.VISIBLE_STRING), "€", "'€' is no VISIBLE_STRING"),
    ],
)
def test_what_is_no_value_is_refused(text: ObjectText, words: str, refusal: str) -> None:
    with pytest.raises(ValueError, match=refusal):
        encode_value(text, words)


@given(st.integers(-0x8000, 0x7FFF), st.sampled_from([1.0, 0.1, 0.25, 1e-3]))
def test_a_number_that_was_read_is_written_as_it_was(number: int, factor: float) -> None:
    text = ObjectText("x", DataType.INTEGER16, "", factor)
    data = DataType.INTEGER16.encode(number)
    shown = text.read(data)[1]
    assert encode_value(text, shown) == data


@given(st.text(max_size=12), st.sampled_from([None, *DataType]), st.sampled_from([1.0, 0.1]))
def test_any_words_are_bytes_or_refused(words: str, kind: DataType | None, factor: float) -> None:
    with suppress(ValueError):
        assert isinstance(encode_value(ObjectText("x", kind, "", factor), words), bytes)
