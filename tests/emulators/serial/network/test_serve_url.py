from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.emulators.serial.network.serve_url import ServeUrl, parse_serve_url


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("rfc2217://7000", ServeUrl("rfc2217", "127.0.0.1", 7_000)),
        ("socket://0", ServeUrl("socket", "127.0.0.1", 0)),
        ("socket://0.0.0.0:65535", ServeUrl("socket", "0.0.0.0", 65_535)),
        ("rfc2217://localhost:1", ServeUrl("rfc2217", "localhost", 1)),
        ("rfc2217://[::1]:7000", ServeUrl("rfc2217", "::1", 7_000)),
    ],
)
def test_a_host_may_be_left_out(text: str, url: ServeUrl) -> None:
    assert parse_serve_url(text) == url
    assert parse_serve_url(str(url)) == url


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("7000", "'7000' is not rfc2217://[HOST:]PORT or socket://[HOST:]PORT"),
        ("tcp://7000", "'tcp://7000' is not rfc2217://[HOST:]PORT or socket://[HOST:]PORT"),
        ("socket://", "'socket://': port '' is not in 0..65535"),
        ("socket://65536", "'socket://65536': port '65536' is not in 0..65535"),
        ("socket://0100000", "'socket://0100000': port '0100000' is not in 0..65535"),
        ("socket://host", "'socket://host': port 'host' is not in 0..65535"),
        ("socket://-1", "'socket://-1': port '-1' is not in 0..65535"),
        ("socket://٣", "'socket://٣': port '٣' is not in 0..65535"),
        ("socket://7000/x", "'socket://7000/x': port '7000/x' is not in 0..65535"),
        ("socket://:7", "'socket://:7': no host before the colon; 0.0.0.0 is every address"),
        ("socket://::1:7", "'socket://::1:7': an IPv6 address stands in brackets, as [::1]"),
        ("socket://[]:7", "'socket://[]:7': no host before the colon; 0.0.0.0 is every address"),
    ],
)
def test_a_bad_url_is_told_with_what_is_allowed(text: str, reason: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011 - the text is the point
        parse_serve_url(text)
    assert str(refused.value) == reason


@given(
    st.text(st.characters(codec="utf-8"))
    | st.text("[]:/0123456789sockethp.").map("socket://{}".format)
)
def test_any_text_is_a_url_or_told(text: str) -> None:
    try:
        url = parse_serve_url(text)
    except ValueError as error:
        told = str(error)
    else:
        told, text = str(parse_serve_url(str(url))), str(url)
    assert text in told or repr(text) in told
