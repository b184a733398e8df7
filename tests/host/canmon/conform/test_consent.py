from __future__ import annotations

import pytest

from tickrig.host.canmon.conform.stimulus import Consent
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.conform.notation import LSS_TO_ALL
from tickrig.host.cli.messages import Refused


def test_others_are_listed_and_a_pipe_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    consent = Consent(yes=False, virtual=False)
    with pytest.raises(Refused, match=r"other nodes may trip\. There is no terminal.*--yes"):
        consent.begin(5, Level.COMMUNICATION, {3: 1, 16: 4})
    assert capsys.readouterr().err == "also on this bus: node 3, node 16\n"
    assert not consent.confirm("SYNC?")


@pytest.mark.parametrize(
    "consent", [Consent(yes=True, virtual=False), Consent(yes=False, virtual=True)]
)
def test_who_said_yes_or_is_alone_is_not_asked(consent: Consent) -> None:
    consent.begin(5, Level.INTRUSIVE, {})
    assert consent.confirm("SYNC?")


def test_lss_is_not_sent_to_several_nodes_of_a_rig() -> None:
    several = Consent(yes=False, virtual=True)
    assert not several.confirm(LSS_TO_ALL)
    assert Consent(yes=False, virtual=True, alone=True).confirm(LSS_TO_ALL)
    assert Consent(yes=True, virtual=True).confirm(LSS_TO_ALL)


def test_reading_needs_no_consent() -> None:
    Consent(yes=False, virtual=False).begin(5, Level.READ_ONLY, {3: 1})
