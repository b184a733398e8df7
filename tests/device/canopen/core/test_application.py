from __future__ import annotations

import pytest

from tickrig.device.canopen.models import f_palette
from tickrig.device.canopen.slave import Application
from tickrig.device.canopen.stack import make_slave


def test_a_device_without_outputs_knows_none() -> None:
    slave = make_slave(f_palette.dictionary(), 16, application=Application)
    application = Application.of(slave)
    assert application.outputs == {}
    with pytest.raises(KeyError, match="do1"):
        application.read("do1")
