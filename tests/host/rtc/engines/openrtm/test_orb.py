from __future__ import annotations

import CosNaming__POA
import pytest
from omniORB import CORBA

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tickrig.host.rtc.engines.openrtm.orb import Orb, explain, nvlist
from tickrig.host.rtc.states import ReturnCode, RtcRefused

pytestmark = OMNIORB


class Raises:
    """Raises what it is given, in each operation of an interface that omniORB brings along."""

    def __init__(self, error: Exception) -> None:
        self._error = error

    def destroy(self) -> None:
        raise self._error


@pytest.mark.parametrize(
    ("error", "answer"),
    [
        (TimeoutError("no time"), CORBA.TIMEOUT),
        (RtcRefused("no such"), CORBA.BAD_PARAM),
        (RtcRefused("has ended", ReturnCode.PRECONDITION_NOT_MET), CORBA.BAD_INV_ORDER),
        (RtcRefused("not here", ReturnCode.UNSUPPORTED), CORBA.NO_IMPLEMENT),
        (RtcRefused("full", ReturnCode.OUT_OF_RESOURCES), CORBA.NO_RESOURCES),
        (CORBA.NO_PERMISSION(0, CORBA.COMPLETED_NO), CORBA.NO_PERMISSION),
        (KeyError("pin"), CORBA.INTERNAL),
    ],
)
def test_whatever_is_raised_is_an_answer(
    orb: Orb, error: Exception, answer: type[Exception]
) -> None:
    reference = orb.serve(CosNaming__POA.BindingIterator, Raises(error))
    with pytest.raises(answer):
        reference.destroy()


def test_what_nobody_foresaw_is_logged(orb: Orb, caplog: pytest.LogCaptureFixture) -> None:
    reference = orb.serve(CosNaming__POA.BindingIterator, Raises(KeyError("pin")))
    with pytest.raises(CORBA.INTERNAL):
        reference.destroy()
    assert caplog.messages == ["OpenRTM: destroy raised"]


def test_an_operation_that_is_not_there_and_an_object_that_has_ended_are_answers(orb: Orb) -> None:
    reference = orb.serve(CosNaming__POA.BindingIterator, object())
    with pytest.raises(CORBA.NO_IMPLEMENT):
        reference.destroy()
    orb.withdraw(reference)
    with pytest.raises(CORBA.OBJECT_NOT_EXIST) as caught:
        reference.destroy()
    assert explain(caught.value) == "it has ended"


def test_a_text_that_is_no_reference_is_refused(orb: Orb) -> None:
    reference = orb.serve(CosNaming__POA.BindingIterator, object())
    assert orb.reference(orb.text(reference))._is_equivalent(reference)
    with pytest.raises(ValueError, match=r"^'nonsense' is no reference: "):
        orb.reference("nonsense")


def test_an_object_that_is_served_here_is_known_by_its_key(orb: Orb) -> None:
    first, second = (orb.serve(CosNaming__POA.BindingIterator, object()) for _ in range(2))
    assert orb.key(first) == orb.key(orb.reference(orb.text(first))) != orb.key(second)
    assert orb.key(orb.reference("corbaloc::127.0.0.1:1/other")) == b""
    assert orb.key(None) == b""


def test_text_that_corba_cannot_carry_is_sent_without_it_and_logged(
    caplog: pytest.LogCaptureFixture,
) -> None:
    sent = nvlist({"price": "10 €\0\udc80", "name": "Ω"})
    assert [(item.name, item.value.value()) for item in sent] == [
        ("price", "10 €\N{REPLACEMENT CHARACTER}\N{REPLACEMENT CHARACTER}"),
        ("name", "Ω"),
    ]
    (message,) = caplog.messages
    assert message.startswith("OpenRTM: 'price': a CORBA string cannot carry '10 €\\x00\\udc80'")
