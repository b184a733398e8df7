from __future__ import annotations

import pytest

from tickrig.wire.canopen.sdo_frame import AbortCode, describe_abort


@pytest.mark.parametrize("code", AbortCode)
def test_every_abort_code_has_a_text_of_its_own(code: AbortCode) -> None:
    others = {describe_abort(other).partition(" (")[0] for other in AbortCode if other != code}
    text, _, number = describe_abort(code).partition(" (")
    assert text not in {*others, "unknown"}
    assert number == f"{code:08X}h)"


def test_an_unknown_abort_code_is_told_by_its_number() -> None:
    assert describe_abort(0x0504_0006) == "unknown (05040006h)"
