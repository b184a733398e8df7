"""What a service says of a place, and of the address of one."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.rtc.ucode.contents_interpretation import Contents, parse_contents
from tickrig.host.rtc.ucode.ucode_settlement import parse_address


def test_information_is_a_place_and_its_properties() -> None:
    text = '{"y_m": 2.5, "x_m": -1, "name": "lift", "floor": 2, "doors": [1, 2]}'
    assert parse_contents(text) == Contents(-1, 2.5, ("doors=[1, 2]", "floor=2", "name=lift"))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "'' is no JSON object"),
        ("[1]", "is no JSON object"),
        ("[" * 100_000, "is no JSON object"),
        ('{"x_m": 1}', "y_m is a number of metres, not null"),
        ('{"x_m": NaN, "y_m": 0}', "x_m is a number of metres, not NaN"),
        ('{"x_m": true, "y_m": 0}', "x_m is a number of metres, not true"),
        ('{"x_m": 1e7, "y_m": 0}', "x_m is a number of metres"),
        ('{"x_m": 1' + "0" * 400 + ', "y_m": 0}', "x_m is a number of metres, not 1000"),
        ('{"x_m": 1, "y_m": 0, "a": "\\u0000"}', "the property 'a' is no short line"),
        ('{"x_m": 1, "y_m": 0, "a": "' + "b" * 300 + '"}', "the property 'a' is no short line"),
        (
            '{"x_m": 1, "y_m": 0,' + ",".join(f'"a{n}": 1' for n in range(33)) + "}",
            "33 properties are more than 32",
        ),
    ],
)
def test_information_that_is_none_is_refused(text: str, told: str) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 - the text follows
        parse_contents(text)
    assert told in str(caught.value)


@pytest.mark.hypothesis
@given(st.text())
def test_any_text_is_information_or_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is no JSON object"):
        parse_contents(text)


def test_an_address_is_one_of_http() -> None:
    assert parse_address(" http://127.0.0.1/a\n") == "http://127.0.0.1/a"
    for text in ("", "file:///etc/passwd", "https://a", "http://" + "a" * 1_000):
        with pytest.raises(ValueError, match="is no address"):
            parse_address(text)
