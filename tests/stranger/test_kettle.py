"""The stranger's own test of the kettle."""

from __future__ import annotations

from kettle_emu import DEVICE, Kettle

from tickrig.testing import check_device, strategies

LINES = [b"heat\n", b"stop\n", b"temp?\n"]


def test_it_keeps_what_every_device_keeps() -> None:
    check_device(DEVICE, traffic=strategies.chunks(LINES), max_examples=10)


def test_water_boils_in_its_time() -> None:
    kettle = Kettle(2_000)
    kettle.tick(0, b"heat\n")
    said = b"".join(kettle.tick(at_us, b"") for at_us in range(1_000, 200_000_000, 1_000_000))
    assert (said, kettle.read("state")) == (b"boils\n", "Boiling")
