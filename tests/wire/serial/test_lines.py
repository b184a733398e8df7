from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tickrig.wire.lines import LineSplitter

pieces = st.lists(st.sampled_from([b"a", b"\n", b"\r", b"bcd", b"\r\n", b"efghijkl"]), max_size=20)


@given(pieces, st.integers(1, 6))
def test_chunking_makes_no_difference(chunks: list[bytes], max_bytes: int) -> None:
    one, many = LineSplitter(max_bytes), LineSplitter(max_bytes)
    together = one.push(b"".join(chunks) + b"\n")
    assert [line for chunk in [*chunks, b"\n"] for line in many.push(chunk)] == together


def test_a_line_may_end_in_cr_lf() -> None:
    assert LineSplitter().push(b"a\r\nb\n\n") == [b"a", b"b", b""]


def test_noise_without_lf_does_not_fill_the_memory() -> None:
    assert LineSplitter(4).push(b"x" * 10) == [b"xxxx", b"xxxx"]


def test_a_begun_line_can_be_forgotten() -> None:
    splitter = LineSplitter()
    splitter.push(b"half")
    splitter.clear()
    assert splitter.push(b"whole\n") == [b"whole"]
