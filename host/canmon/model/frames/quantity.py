"""Numbers as tables show them: as many digits as a column has room for."""

from __future__ import annotations


def ms_text(time_us: int | None) -> str:
    """Write a time in milliseconds, no more than 8 characters below 11 days.

    >>> ms_text(None), ms_text(1_234), ms_text(999_999), ms_text(12_345_678)
    ('-', '1.234', '999.999', '12345.7')
    """
    if time_us is None:
        return "-"
    if time_us < 1_000_000:
        return f"{time_us / 1e3:.3f}"
    return f"{time_us / 1e3:.1f}" if time_us < 100_000_000 else f"{time_us // 1_000}"


def s_text(time_us: int) -> str:
    """Write an age in seconds; what lies in the future has none.

    >>> s_text(-5), s_text(12_340_000), s_text(123_456_000_000)
    ('0.0', '12.3', '123456')
    """
    return f"{max(0, time_us) / 1e6:.1f}" if time_us < 10_000_000_000 else f"{time_us // 1_000_000}"


def rate_text(per_s: float) -> str:
    """Write a rate, no more than 7 characters.

    >>> rate_text(0.0), rate_text(9.987), rate_text(12345.6)
    ('0.00', '9.99', '12346')
    """
    return f"{per_s:.2f}" if per_s < 1_000 else f"{per_s:.0f}"


def load_text(bits_s: int, bit_rate: int | None) -> str:
    """Write a load: a share of the bit rate if that is known, else bits a second.

    >>> load_text(123_456, 1_000_000), load_text(123_456, None)
    ('12.3 %', '123.5 kbit/s')
    """
    if bit_rate is None:
        return f"{bits_s / 1e3:.1f} kbit/s"
    return f"{bits_s * 100 / bit_rate:.1f} %"


def count_text(count: int | None) -> str:
    """Write a count, a dash where there is none."""
    return "-" if count is None else str(count)
