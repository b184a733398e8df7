"""The verbs `net store` and `net restore`: 1010h and 1011h."""

from __future__ import annotations

import click

from tickrig.host.canmon.net.group import NetCall
from tickrig.host.canmon.net.session import net_session
from tickrig.host.canmon.net.stored import AREAS, load_defaults, reset, save
from tickrig.host.cli.options import NODE_ID
from tickrig.host.cli.refused import Refused


def _sub(word: str) -> int:
    if word in AREAS:
        return AREAS[word]
    number = int(word) if word.isascii() and word.isdecimal() else 0
    if not 1 <= number <= 0x7F:
        raise Refused(f"{word!r} is none of {', '.join(AREAS)}, and no sub-index 1..127")
    return number


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("area", default="all")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def store(call: NetCall, node: int, area: str, yes: bool) -> None:
    """Store parameters of NODE (1010h): all, communication, application or a sub-index.

    \b
    canmon net can0 store 5
    canmon net can0 store 5 communication --yes
    """  # noqa: D301 - click wants the backspace
    sub = _sub(area)
    with net_session(call, node) as session:
        session.confirm(f"node {node} stores its parameters: {area}", yes=yes)
        session.work.plan("store")
        save(session, node, sub)
        session.work.done()


@click.command()
@click.argument("node", type=NODE_ID)
@click.argument("area", default="all")
@click.option("--reset", "then_reset", is_flag=True, help="Reset it, so that they count at once.")
@click.option("--yes", is_flag=True, help="Ask nothing.")
@click.pass_obj
def restore(call: NetCall, node: int, area: str, then_reset: bool, yes: bool) -> None:
    """Restore the defaults of NODE (1011h): all, communication, application or a sub-index.

    They count from its next reset.

    \b
    canmon net can0 restore 5 --reset
    canmon net can0 restore 5 communication
    """  # noqa: D301 - click wants the backspace
    sub = _sub(area)
    risk = "Limits and gains of a drive become those of its maker"
    if then_reset:
        risk += "; it lets go of its motor: what hangs on it may fall"
    with net_session(call, node) as session:
        session.confirm(f"node {node} forgets its parameters: {area}", yes=yes, risk=risk)
        session.work.plan("restore", *(["reset"] if then_reset else []))
        load_defaults(session, node, sub)
        session.work.done()
        if then_reset:
            reset(session, node, sub)
            session.work.done()
