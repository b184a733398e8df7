"""The name service of a manager: paths are bound, looked up and listed."""

from __future__ import annotations

import pytest

from tickrig.host.rtc.components import ConsoleIn
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.manager import NameService


def test_a_path_is_bound_once_and_may_be_deep() -> None:
    names = NameService()
    names.bind("/localhost/my.host_cxt/A0.rtc", component := ConsoleIn("A0"))
    assert names.names("localhost") == ("my.host_cxt/",)
    assert names.resolve("localhost/my.host_cxt/A0.rtc") is component
    with pytest.raises(RtcRefused, match="is taken"):
        names.bind("localhost/my.host_cxt/A0.rtc", component)
    names.unbind("localhost/my.host_cxt/A0.rtc")
    names.unbind("localhost/my.host_cxt/A0.rtc")
    assert names.names() == ()
