"""Descriptions of components as people read them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from tickrig.host.text.page_text import json_text
from tickrig.host.text.values import format_time


def component_row(component: Any) -> str:
    """Write a line of `ls -l`: state, ports with those that are connected, rate, type, name."""
    ports = component["ports"]
    connected = sum(1 for port in ports if port["connectors"])
    rate = "".join(f"{context['rate_hz']:g}Hz" for context in component["contexts"][:1])
    state = component["state"].capitalize()
    return (
        f"{state:<9} {len(ports):>3}/{connected:<3} {rate:>9}  "
        f"{component['type']:<16} {component['name']}"
    )


def component_lines(component: Any, *, long: bool) -> Iterator[str]:
    """Write what `cat` shows.

    Args:
        component: its description.
        long: connectors with their properties, and all configuration sets.
    """
    yield f"{component['name']}  {component['state'].capitalize()}"
    yield f"  {'Path':<14}{component['path']}"
    for key in ("type", "description", "version", "vendor", "category"):
        yield f"  {key.capitalize():<14}{component[key]}".rstrip()
    for name, text in component["properties"].items():
        yield f"  {'Property':<14}{name} = {text}"
    for context in component["contexts"]:
        runs = "" if context["running"] else ", stopped"
        yield f"  {'Runs at':<14}{context['rate_hz']:g} Hz{runs}"
    for port in component["ports"]:
        yield from _port_lines(port, long=long)
    yield from configuration_lines(component["configuration"], long=long)


def port_line(port: Any) -> str:
    """Write what a port is: its kind, name and data type."""
    return f"  {port['kind']:<14}{port['name']}  {_short_type(port['data_type'])}".rstrip()


def _port_lines(port: Any, *, long: bool) -> Iterator[str]:
    yield port_line(port)
    for interface in port["interfaces"]:
        yield f"    {interface['polarity'].lower()} {interface['name']} ({interface['type']})"
    for connector in port["connectors"]:
        others = [name for name in connector["ports"] if name != port["name"]]
        lost = " (lost)" if connector.get("state") == "lost" else ""
        yield f"    connected to {(others or connector['ports'])[0]}{lost}"
        if long:
            properties = {"name": connector["name"], **connector["properties"]}
            yield from (f"      {key} = {value}" for key, value in properties.items())


def configuration_lines(configuration: Any, *, long: bool) -> Iterator[str]:
    """Write the parameters with the values that hold, and with `long` those of each set."""
    for parameter in configuration["parameters"]:
        value = f"{parameter['name']} = {parameter['value']} {parameter['unit']}".rstrip()
        allowed = f"  [{parameter['constraint']}]" if parameter["constraint"] else ""
        yield f"  {'Parameter':<14}{value}{allowed}"
    if not configuration["parameters"]:
        return
    for set_id, values in configuration["sets"].items():
        star = " *" if set_id == configuration["active"] else ""
        yield f"  {'Set':<14}{set_id}{star}"
        if long:
            yield from (f"    {name} = {value}" for name, value in values.items())


def value_line(value: Any) -> str:
    """Write a value of a port: its time in seconds if it has one, and its data.

    >>> value_line({"tm": {"sec": 1, "nsec": 500000000}, "data": -5})
    '1.500000 -5'
    >>> value_line({"x": 1.0})
    '{"x": 1.0}'
    """
    if set(value) == {"tm", "data"}:
        time_us = value["tm"]["sec"] * 1_000_000 + value["tm"]["nsec"] // 1_000
        return f"{format_time(time_us)} {json_text(value['data'])}"
    return json_text(value)


def _short_type(idl_id: str) -> str:
    """Write `IDL:RTC/TimedLong:1.0` as `TimedLong`."""
    return idl_id.removeprefix("IDL:").removesuffix(":1.0").removeprefix("RTC/")
