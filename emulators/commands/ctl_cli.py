"""The command `tickrig ctl`: operate and watch a running emulator."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import wraps
from math import degrees
from typing import TYPE_CHECKING, Any, Final

import click

from tickrig._lazy import LazyModule
from tickrig.host.cli.control import request
from tickrig.host.cli.messages import Refused, time_us
from tickrig.host.cli.options import PATH
from tickrig.host.control.client import ControlClient
from tickrig.host.control.requests import Object
from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import format_time, parse_setting

if TYPE_CHECKING:
    from pathlib import Path

    from tickrig.host.rtc.motion import path_file
else:  # completion does without
    path_file = LazyModule("tickrig.host.rtc.motion.path_file")

_PATIENCE_S: Final = 1.0

_Complete = Callable[[click.Context, click.Parameter, str], list[str]]
_Names = Callable[[Any], Iterator[str]]
"""Function that returns names from the answer of an emulator to `describe`."""


def _buttons(described: Any) -> Iterator[str]:
    """Return the names of buttons."""
    return (each["name"] for each in described.get("inputs", ()) if each["kind"] == "button")


def faults(described: Any) -> Iterator[str]:
    """Yield faults of the wire, then faults of the device."""
    yield from (each["name"] for each in described.get("wire_faults", ()))
    yield from (each["name"] for each in described.get("inputs", ()) if each["kind"] == "fault")


def _settable(described: Any) -> Iterator[str]:
    """Yield the names of groups and inputs."""
    yield from described.get("groups", ())
    yield from (each["name"] for each in described.get("inputs", ()))


def _seen(described: Any) -> Iterator[str]:
    """Yield the names of inputs and outputs."""
    yield from (
        each["name"] for each in [*described.get("inputs", ()), *described.get("outputs", ())]
    )


def _complete(names: _Names) -> _Complete:
    """Return a completion function for names."""

    def completed(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
        assert context.parent is not None
        try:
            with ControlClient(context.parent.params["socket"], _PATIENCE_S) as client:
                described = client.request("describe")
        except (OSError, ValueError):  # no server, or another one
            return []
        return [name for name in names(described) if name.startswith(begun)]

    return completed


_EMULATOR: Final = "emulator"
_SERVER: Final = "server"
_CART: Final = "cart"

_AS_JSON: Final = "Print the answer as JSON."


@click.group()
@click.argument("socket", type=click.Path())
@click.pass_context
def ctl(context: click.Context, /, socket: str) -> None:
    """Operate and watch the emulator whose control socket is SOCKET.

    \b
    tickrig ctl /tmp/rrc.ctl describe
    tickrig ctl /tmp/rrc.ctl press power_button
    tickrig ctl /tmp/rrc.ctl set stick 100 -20
    tickrig ctl /tmp/rrc.ctl fault flip=0.001
    tickrig ctl /tmp/rrc.ctl get state out_v_pct
    """  # noqa: D301 - click wants the backspace
    context.obj = socket


def _nothing(answer: Object) -> list[str]:
    return []


def _values(answer: Any) -> list[str]:
    return [f"{name} {value}" for name, value in answer["values"].items()]


def _lines(answer: Any) -> list[str]:
    return [f"{format_time(x['at_us'])} {x['mark']} {x['text']}" for x in answer["lines"]]


def _status(answer: Any) -> list[str]:
    fields = {name: value for name, value in answer.items() if name not in ("v", "ok")}
    nodes = fields.pop("nodes", [])
    return [f"{name} {value}".rstrip() for name, value in fields.items()] + [
        " ".join(f"{name} {value}" for name, value in node.items() if value not in ("", None))
        for node in nodes
    ]


def _faults(answer: Any) -> list[str]:
    rows = [("fault", "on", "since", "acted", "arguments")]
    for x in answer["faults"]:
        since = "" if x["since_us"] is None else f"{format_time(x['since_us'])} s"
        acted = "" if x["acted"] is None else str(x["acted"])
        arguments = " ".join(f"{key}={word}" for key, word in x["arguments"].items())
        rows.append((x["name"], "on" if x["on"] else "off", since, acted, arguments))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def _describe(answer: Any) -> list[str]:
    if "components" in answer:  # a system of RT components, or a server that has one
        return [f"{x['name']} {x['type']} {x['state']}" for x in answer["components"]]
    out = [f"{answer['device']}, a tick each {answer['tick_us'] / 1_000:g} ms", "", "inputs"]
    for x in answer["inputs"]:
        limits = "" if x["kind"] == "text" else f"{x['low']}..{x['high']}"
        limits = f"{limits} {x['unit']}".strip()
        out.append(f"  {x['name']:<20} {x['kind']:<7} {limits:<12} {x['text']}")
    out += ["", "groups"]
    out += [f"  {name:<20} {' '.join(members)}" for name, members in answer["groups"].items()]
    out += ["", "outputs"]
    out += [f"  {x['name']:<20} {x['unit']:<7} {x['text']}" for x in answer["outputs"]]
    out += ["", "faults of the wire"]
    for x in answer["wire_faults"]:
        out.append(f"  {x['usage']:<20} {x['text']}")
    return out


def verb(
    show: Callable[[Any], list[str]] = _nothing, whom: str = _EMULATOR, **settings: Any
) -> Callable[[Callable[..., Object]], click.Command]:
    """Return a decorator that makes a command of `tickrig ctl`.

    The decorated function gets the arguments of the command line, and returns the fields of a
    request. The command sends this request to an emulator, and prints the answer of the emulator.

    Args:
        show: function that formats the answer as lines of text.
        whom: name of the program that answers, for messages.
        settings: keyword arguments for the decorator `ctl.command` of click, such as
            `context_settings`.
    """

    def decorate(fields: Callable[..., Object]) -> click.Command:
        do = fields.__name__.rstrip("_")

        @wraps(fields)
        def run(socket: str, as_json: bool, **arguments: Any) -> None:
            answer = request(socket, whom, do, **fields(**arguments))
            for line in [json_text(answer)] if as_json else show(answer):
                click.echo(line)

        command = ctl.command(do, **settings)(click.pass_obj(run))
        command.params.append(click.Option(["--json", "as_json"], is_flag=True, help=_AS_JSON))
        return command

    return decorate


@verb(_describe)
def describe() -> Object:
    """List inputs, groups, outputs and faults.

    \b
    tickrig ctl /tmp/rrc.ctl describe
    tickrig ctl /tmp/rrc.ctl describe --json
    """  # noqa: D301 - click wants the backspace
    return {}


@verb(_values)
@click.argument("names", nargs=-1, shell_complete=_complete(_seen))
def get(names: tuple[str, ...]) -> Object:
    """Show inputs and outputs by NAME; without names, show all.

    \b
    tickrig ctl /tmp/rrc.ctl get state out_v_pct
    """  # noqa: D301 - click wants the backspace
    return {"names": list(names)} if names else {}


@verb(context_settings={"ignore_unknown_options": True})
@click.argument("name", shell_complete=_complete(_settable))
@click.argument("values", nargs=-1, required=True)
def set_(name: str, values: tuple[str, ...]) -> Object:
    """Set the input or group NAME to VALUES, such as 'set stick 100 -20'.

    \b
    tickrig ctl /tmp/rrc.ctl set stick 100 -20
    """  # noqa: D301 - click wants the backspace
    return {"name": name, "value": [parse_setting(value) for value in values]}


@verb()
@click.argument("name", shell_complete=_complete(_buttons))
@click.option(
    "--for", "duration", default="100ms", help="How long to press, such as 500ms.  [100ms]"
)
def press(name: str, duration: str) -> Object:
    """Press the button NAME; it is released automatically. To hold it: set NAME 1.

    \b
    tickrig ctl /tmp/rrc.ctl press power_button --for 500ms
    """  # noqa: D301 - click wants the backspace
    return {"name": name, "duration_us": time_us("--for", duration)}


@verb()
@click.argument("spec", shell_complete=_complete(faults))
@click.option("--for", "duration", help="How long the fault lasts, such as 2s.  [until cleared]")
def fault(spec: str, duration: str | None) -> Object:
    """Start a fault: NAME[=ARGUMENT[,ARGUMENT]][@FROM[-TO]].

    FROM and TO are times since the start of the emulator. Times with +, as in cut@+1s-+2s, count
    from now.

    \b
    tickrig ctl /tmp/rrc.ctl fault flip=0.001
    tickrig ctl /tmp/rrc.ctl fault cut --for 2s
    """  # noqa: D301 - click wants the backspace
    if duration is not None:
        if "@" in spec:
            raise Refused(f"--for {duration}: {spec!r} has times of its own; give one of both")
        spec += f"@+0s-+{time_us('--for', duration)}us"
    return {"spec": spec}


@verb()
@click.argument("name", shell_complete=_complete(faults))
def clear(name: str) -> Object:
    """Clear the fault NAME.

    \b
    tickrig ctl /tmp/rrc.ctl clear flip
    """  # noqa: D301 - click wants the backspace
    return {"name": name}


@verb(_faults)
def faults_() -> Object:
    """List the faults: on or off, start time, how often each fault has acted, arguments.

    \b
    tickrig ctl /tmp/rrc.ctl faults
    """  # noqa: D301 - click wants the backspace
    return {}


@verb(_lines)
@click.option("--since", type=int, default=0, help="Show only the lines after this line number.")
def lines(since: int) -> Object:
    """Show the latest lines on the wire, at most 100.

    \b
    tickrig ctl /tmp/rrc.ctl lines --json
    """  # noqa: D301 - click wants the backspace
    return {"since": since}


@verb(_status)
def status() -> Object:
    """Show the status of the run: time, late ticks, lost bytes, faults.

    \b
    tickrig ctl /tmp/rrc.ctl status
    """  # noqa: D301 - click wants the backspace
    return {}


@verb(whom=_SERVER)
@click.argument("node", type=click.IntRange(1, 127))
def restart(node: int) -> Object:
    """Reset a node of an rtc-canopen-server. The server sets up the node again after the reset.

    NODE is the node-ID.

    \b
    tickrig ctl /tmp/robot.ctl restart 5
    """  # noqa: D301 - click wants the backspace
    return {"node": node}


_NUMBERS: Final = {"ignore_unknown_options": True}


@verb(whom=_CART, context_settings=_NUMBERS)
@click.argument("x", type=float)
@click.argument("y", type=float)
@click.argument("deg", type=float)
def goal(x: float, y: float, deg: float) -> Object:
    """Drive the cart of a running 'rh3 serve' to X and Y in metres, and turn it to DEG degrees.

    \b
    tickrig ctl /tmp/cart goal 1 0.5 90
    """  # noqa: D301 - click wants the backspace
    return {"pose": [x, y, deg]}


@verb(whom=_CART)
@click.argument("file", type=PATH, required=False)
def path(file: Path | None) -> Object:
    """Drive the cart of a running 'rh3 serve' along the points of FILE.

    FILE has the format of 'rh3 path'. Without FILE, the cart drives a square of 1 m.

    \b
    tickrig ctl /tmp/cart path corners.txt
    """  # noqa: D301 - click wants the backspace
    if file is None:
        return {}
    try:
        points = path_file.read_path(file)
    except ValueError as error:
        raise Refused(str(error)) from None
    return {"points": [[x, y, degrees(heading)] for x, y, heading in points]}


@verb(whom=_CART)
def end() -> Object:
    """Finish the commands of 'rh3 serve', then put its component PositionInput into Error.

    Error is a state of an RT component. PositionInput accepts no more commands until you reset and
    activate it.

    \b
    tickrig ctl /tmp/cart end
    """  # noqa: D301 - click wants the backspace
    return {}


@verb()
def stop() -> Object:
    """End the emulator.

    \b
    tickrig ctl /tmp/rrc.ctl stop
    """  # noqa: D301 - click wants the backspace
    return {}
