from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.emulators.lamp import Lamp
from tickrig.emulators.bench.control import EmulatorControl
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.control.requests import RequestDispatcher


def ask(emulator: Emulator, do: object, **fields: object) -> Any:
    line = json.dumps({"v": 1, "do": do, **fields}).encode()
    answer = json.loads(EmulatorControl(emulator).answer_line(line))
    assert answer["v"] == 1
    return answer


def test_describe_lists_all_names(emulator: Emulator) -> None:
    answer = ask(emulator, "describe")
    assert (answer["device"], answer["tick_us"]) == ("lamp", 1_000)
    assert answer["inputs"][2] == {
        **{"name": "x_mm", "text": "x", "kind": "level", "low": -10, "high": 10, "unit": "mm"}
    }
    assert answer["groups"] == {"place": ["x_mm", "y_mm"]}
    assert answer["outputs"][1] == {"name": "count", "text": "bytes heard", "unit": "B"}
    assert [fault["name"] for fault in answer["wire_faults"]] == list(BYTE_FAULTS)


def test_get_gives_all_or_what_is_named(emulator: Emulator) -> None:
    everything = ask(emulator, "get")["values"]
    assert list(everything) == ["lamp", "key", "x_mm", "y_mm", "dead", "state", "count"]
    assert ask(emulator, "get", names=["state", "lamp"])["values"] == {"state": "Lit", "lamp": 1}


class Unlisted(dict[str, Any]):
    """Can be asked, and not listed."""

    def __iter__(self) -> Any:
        raise AssertionError("all names were listed")


def test_what_is_named_is_got_without_a_list_of_all(
    emulator: Emulator, monkeypatch: pytest.MonkeyPatch
) -> None:
    inputs = emulator.device.inputs
    monkeypatch.setattr(inputs, "table", Unlisted(inputs.table))
    assert ask(emulator, "get", names=["state", "lamp"])["values"] == {"state": "Lit", "lamp": 1}


def test_set_takes_one_value_or_those_of_a_group(emulator: Emulator) -> None:
    assert ask(emulator, "set", name="lamp", value=0) == {"v": 1, "ok": True}
    assert ask(emulator, "set", name="place", value=[1, -2])["ok"]
    values = ask(emulator, "get", names=["lamp", "x_mm", "y_mm"])["values"]
    assert values == {"lamp": 0, "x_mm": 1, "y_mm": -2}


def test_a_press_ends_by_the_time_of_the_rig(emulator: Emulator) -> None:
    emulator.step()
    assert ask(emulator, "press", name="key", duration_us=2_000)["ok"]
    assert emulator.event_queue.due_us == 4_000
    assert emulator.device.inputs["key"] == 1


def test_faults_of_wire_and_device_come_and_go(emulator: Emulator) -> None:
    assert ask(emulator, "fault", spec="flip=0.5")["ok"]
    assert ask(emulator, "fault", spec="dead")["ok"]
    assert ask(emulator, "status")["faults"] == "flip dead"
    assert ask(emulator, "clear", name="flip")["ok"]
    assert ask(emulator, "clear", name="dead")["ok"]
    assert ask(emulator, "status")["faults"] == ""


def test_a_fault_comes_some_time_from_now_on(emulator: Emulator) -> None:
    for _ in range(5):
        emulator.step()
    assert ask(emulator, "fault", spec="dead@+10ms-+30ms")["ok"]
    assert emulator.event_queue.due_us == emulator.effective_us + 10_000


def test_lines_are_those_of_the_wire(emulator: Emulator) -> None:
    for _ in range(5):
        emulator.step()
    (line,) = ask(emulator, "lines")["lines"]
    assert line == {"number": 1, "at_us": 1_261, "mark": "<", "text": "hi"}
    assert ask(emulator, "lines", since=1)["lines"] == []


def test_late_steps_are_those_since_a_time(emulator: Emulator) -> None:
    assert ask(emulator, "status", since=0)["late_us"] == 0
    assert not ask(emulator, "status", since=-1)["ok"]


def test_status_and_stop(emulator: Emulator) -> None:
    status = ask(emulator, "status")
    assert (status["now_us"], status["late_steps"], status["lost_bytes"]) == (0, 0, 0)
    assert ask(emulator, "stop")["ok"]
    assert not emulator.running


def test_an_id_comes_back(emulator: Emulator) -> None:
    assert ask(emulator, "stop", id="a7")["id"] == "a7"
    assert ask(emulator, "nope", id=3)["id"] == 3


@pytest.mark.parametrize(
    ("request_", "error"),
    [
        ({"do": "get"}, "version null of the request is not 1"),
        ({"v": 2, "do": "get"}, "version 2 of the request is not 1"),
        ({"v": 1.0, "do": "get"}, "version 1.0 of the request is not 1"),
        ({"v": True, "do": "get"}, "version true of the request is not 1"),
        ({"v": 1, "do": "get", "id": True}, "id is a whole number or a string, not true"),
        ({"v": 1, "do": "get", "id": 1.5}, "id is a whole number or a string, not 1.5"),
        ({"v": 1, "do": "get", "id": None}, "id is a whole number or a string, not null"),
        ({"v": 1}, "no request null; known: describe, get, set"),
        ({"v": 1, "do": "reboot"}, 'no request "reboot"; known: describe'),
        ({"v": 1, "do": ["get"]}, 'no request ["get"]; known'),
        ({"v": 1, "do": "get", "name": "x"}, 'get has no field "name"; fields: names'),
        ({"v": 1, "do": "get", "names": "x"}, 'names is a list of names, not "x"'),
        ({"v": 1, "do": "get", "names": [[]]}, "no input or output []; known: state"),
        ({"v": 1, "do": "set", "name": "lamp"}, "value is a number or a string, not null"),
        ({"v": 1, "do": "set", "name": "lamp", "value": 1.5}, "lamp takes a whole number, not 1.5"),
        ({"v": 1, "do": "set", "name": "lamp", "value": True}, "a number or a string, not true"),
        ({"v": 1, "do": "set", "name": 5, "value": 1}, "name is a string, not 5"),
        ({"v": 1, "do": "set", "name": "a", "value": 1}, "no input 'a'; known: place, lamp"),
        ({"v": 1, "do": "press", "name": "key", "duration_us": -1}, "-1 is not in 1..1000"),
        (
            {"v": 1, "do": "press", "name": "key", "duration_us": 10**15 + 1},
            "duration_us 1000000000000001 is not in 1..1000000000000000",
        ),
        ({"v": 1, "do": "lines", "since": -1}, "since -1 is not in 0..9223372036854775807"),
        ({"v": 1, "do": "fault", "spec": "flip=2"}, "flip takes a rate"),
        ({"v": 1, "do": "clear", "name": "x" * 5_000}, "no fault 'xxx"),
        ({"v": 1, "do": "get", "names": ["../etc"]}, 'no input or output "../etc"'),
        ({"v": 1, "do": "set", "name": "\ud800", "value": 1}, "no input '\\ud800'"),
    ],
)
def test_a_bad_request_is_answered_and_changes_nothing(
    emulator: Emulator, request_: dict[str, object], error: str
) -> None:
    before = ask(emulator, "get")
    answer = json.loads(EmulatorControl(emulator).answer_line(json.dumps(request_).encode()))
    assert answer["ok"] is False
    assert error in answer["error"]
    assert ask(emulator, "get") == before


@pytest.mark.parametrize(
    "line",
    [
        b"",
        b"{",
        b"[]",
        b"1",
        b"\xff\xfe",
        b"[" * 4_000,
        b'{"v":1,"do":"get","id":' + b"[" * 1_800 + b"]" * 1_800 + b"}",
        b'{"v":1,"do":' + b"[" * 1_800 + b"]" * 1_800 + b"}",
        b"9" * 4_400,
    ],
)
def test_what_is_no_object_is_answered(emulator: Emulator, line: bytes) -> None:
    answer = json.loads(EmulatorControl(emulator).answer_line(line))
    assert answer["v"] == 1
    if not line.startswith(b'{"v":1,"do":"get"'):
        assert not answer["ok"]


@pytest.mark.parametrize(
    ("line", "error"),
    [
        (b'{"v":1,"do":"g\xffet"}', "the line is not UTF-8: byte 14 is ffh"),
        ('{"v":1,"do":"get"}'.encode("utf-16"), "the line is not UTF-8: byte 0 is ffh"),
        ('{"v":1,"do":"get"}'.encode("utf-8-sig"), "the line is not a JSON object: "),
        (b'{"v":1,"do":"set","name":"lamp","value":NaN}', "JSON has no NaN"),
        (b'{"v":1,"do":"set","name":"lamp","value":-Infinity}', "JSON has no -Infinity"),
    ],
)
def test_a_line_is_json_in_utf_8(emulator: Emulator, line: bytes, error: str) -> None:
    answer = EmulatorControl(emulator).answer_line(line)
    assert answer.count(b"\n") == 1
    assert error in json.loads(answer)["error"]


def test_a_number_that_json_lacks_is_text() -> None:
    values: dict[str, object] = {"values": [float("nan"), float("inf"), -float("inf"), 1.5]}
    requests = RequestDispatcher({"get": (lambda request: values, ())})
    answer = json.loads(requests.answer_line(b'{"v":1,"do":"get"}'))
    assert answer["values"] == ["nan", "inf", "-inf", 1.5]


@given(st.binary(max_size=300))
def test_noise_is_answered_with_one_line(noise: bytes) -> None:
    answer = EmulatorControl(Emulator("lamp", Lamp())).answer_line(noise)
    assert answer.count(b"\n") == 1
    assert json.loads(answer)["ok"] is False
