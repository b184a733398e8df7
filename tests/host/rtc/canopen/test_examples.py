"""The programs in examples/ that run systems of RTC-CANopen."""

from __future__ import annotations

import runpy

import pytest

from tests.host.rtc.canopen.bench import EXAMPLES


def run(name: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    runpy.run_path(str(EXAMPLES / f"rtc_canopen_{name}.py"), run_name="__main__")
    return capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("name", ["beego", "fourx"])
def test_a_robot_goes_where_its_joystick_says_and_knows_where_it_is(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = run(name, capsys)
    assert lines[0] == "at 0.00 0.00; thinks 0.00 0.00"
    straight, arc, turned, stands = ([float(x) for x in _numbers(line)] for line in lines[1:])
    assert straight[0] == pytest.approx(0.9, abs=0.05)  # 3 s at 0.3 m/s
    assert straight[1] == 0.0
    assert arc[1] > 0.1
    assert turned == stands
    for x, y, thinks_x, thinks_y in (straight, arc, turned, stands):
        assert (thinks_x, thinks_y) == pytest.approx((x, y), abs=0.011)


def test_fig_120_is_the_same_by_link_and_by_ports(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("fig120", capsys) == [
        "by PDO link, the PC gone: 90.00 deg",
        "by ports through the PC: 90.00 deg",
    ]


def test_followers_follow_as_they_are_connected(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("followers", capsys) == ["30.0 30.0 0.0", "60.0 30.0 60.0", "90.0 90.0 90.0"]


def _numbers(line: str) -> list[str]:
    return line.replace("at ", "").replace("; thinks", "").split()
