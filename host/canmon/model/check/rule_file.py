"""A file of rules, in TOML: all that is wrong with it is told at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from tickrig.host.canmon.model.check.rules import LISTS, LoadRule, RuleValues, parse_rules
from tickrig.host.text.toml_reader import load_toml, read_toml
from tickrig.host.text.values import counted


def parse_rule_file(text: str, load_rule: LoadRule) -> RuleValues:
    """Return the rules of a file by their names.

    Args:
        text: the whole file.
        load_rule: see `parse_rules`.

    Raises:
        ValueError: what is wrong, each mistake with its line.
    """
    try:
        words = load_toml(text)
        parse_rules(words, load_rule)
    except ValueError as error:
        mistakes = _mistakes(text, load_rule) or [str(error)]
        if len(mistakes) == 1:
            raise ValueError(mistakes[0]) from None
        lines = (f"\n  {mistake}" for mistake in mistakes)
        raise ValueError(f"{counted(len(mistakes), 'mistake')}{''.join(lines)}") from None
    return words


def _mistakes(text: str, load_rule: LoadRule) -> list[str]:
    """Try each rule alone; of text that is no TOML nothing else is said."""
    document = read_toml(text)
    found = [(line, reason) for line, reason in document.mistakes]
    for path, words in () if found else _alone(document.values):
        try:
            parse_rules(words, load_rule)
        except ValueError as error:
            found.append((document.line_of(path), str(error)))
    return [f"line {line}: {reason}" for line, reason in sorted(found)]


def _alone(words: RuleValues) -> Iterator[tuple[tuple[str | int, ...], RuleValues]]:
    """Give each rule with its path."""
    for name, value in words.items():
        if name in LISTS and isinstance(value, Mapping):
            yield from (((name, key), {name: {key: entry}}) for key, entry in value.items())
        elif name in LISTS and isinstance(value, list):
            yield from (((name, at), {name: [entry]}) for at, entry in enumerate(value))
        else:
            yield (name,), {name: value}
