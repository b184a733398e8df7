"""RRC: a synchronous client for the Robotic Relay Communicator, on any link."""

from tickrig.host.rrc.channel import RrcLoad, RrcRefused, RrcStopped
from tickrig.host.rrc.client import RrcClient
from tickrig.host.rrc.inbox import Arrival
from tickrig.host.rrc.reply_matcher import OnRefusals

__all__ = ["Arrival", "OnRefusals", "RrcClient", "RrcLoad", "RrcRefused", "RrcStopped"]
