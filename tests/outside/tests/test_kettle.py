"""The host of the kettle, with the kettle's own emulator."""

from __future__ import annotations

import pytest
from boiler.kettle import KettleError, KettleHost

from tickrig import Bench

pytestmark = pytest.mark.needs("device:kettle")


@pytest.mark.req("BOIL-1")
def test_water_gets_hot(bench: Bench, kettle: KettleHost) -> None:
    bench["kettle"].set("water_ml", 100)
    assert kettle.temperature_c() == 20
    kettle.heat()
    bench.run_for("1s")
    assert kettle.temperature_c() > 20
    kettle.stop()
    assert bench["kettle"].observe("it is off", lambda: bench["kettle"].get("state") == "Cold")


@pytest.mark.req("SAF-1")
def test_an_open_lid_keeps_it_cold(bench: Bench, kettle: KettleHost) -> None:
    bench["kettle"].press("lid_open", for_="500ms")
    bench.run_for("50ms")
    with pytest.raises(KettleError, match="does not heat"):
        kettle.heat()


@pytest.mark.req("SAF-2")
@pytest.mark.needs("fault:cut")
def test_a_cut_line_is_told(bench: Bench, kettle: KettleHost) -> None:
    bench["kettle"].fault("cut", for_="2s")
    with pytest.raises(KettleError, match="no whole line in"):
        kettle.temperature_c()


@pytest.mark.needs("fault:sensor_broken")
def test_a_broken_thermometer_is_told(bench: Bench, kettle: KettleHost) -> None:
    bench["kettle"].fault("sensor_broken")
    with pytest.raises(KettleError, match="thermometer"):
        kettle.temperature_c()
