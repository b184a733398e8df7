"""Rules and files of rules with chance in them: characters, words, rules mixed, cut off, binary."""

from __future__ import annotations

import tomllib
from random import Random
from typing import Final

from tests.host.canmon.model.check.expression.held import MAPPED
from tests.host.canmon.model.record_log import hear
from tests.mutators import spoilt
from tickrig.host.canmon.model.check.checker import Checker, Surroundings
from tickrig.host.canmon.model.check.rule_parser import DEMANDS
from tickrig.host.canmon.model.check.rules import RuleValues, parse_rules
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.verbs.check import finding_json

RULES: Final = (
    *("node 3 operational within 2s", "node 3-5 operational within 1s after boot-up of 3-5"),
    *("3.statusword.fault never", "3.statusword.remote always", "statusword.3 of 3 never"),
    *("emcy of 5 in {8130h, 8140h..81FFh}", "heartbeat in {operational, stopped}"),
    *("3.position_actual_value in -500..500 while 3.statusword.operation_enabled",),
    *("tpdo1 of 3 every 10ms ±10%", "tpdo1 every 5ms..", "heartbeat every ..20ms"),
    *("sync every 9ms..11ms", "sync to tpdo1 of 3 under 2ms", "sdo answered within 50ms"),
    *("guard answered within 20ms", "guard toggle", "dlc", "dlc of 3-5", "sdo[6040h] dlc"),
    *("boot-up of 3 once", "emcy at most 3", "emcy at most 3 per 1s", "emcy at least 1"),
    *("181[2:4]s*0.01 in -5..5", "183[0.3] never", "183[2:6] steps under 5"),
    *("sync counts", "3.position_actual_value steps under 100", "speed changes within 1s"),
    *("not (181-18F or 080) never", "123:7FF,400~700 never", "node=3 and (pdo or emcy) never"),
    *("sdo.aborted never before node 3 operational", "no fault: 3.statusword.fault never"),
)
"""One of each kind at least."""
FILE: Final = """\
no_emcy = true
no_lost_heartbeat = true
no_error_frames = true
max_load = 60
bitrate = 500000
nodes = [3, "NODES"]
heartbeat = {3 = "100ms±20%"}
max_gap = {181 = "20ms"}
known = "KNOWN"
"""
RANGES: Final = (
    *("16-18", "1", "1-", "-5", "1-2-3", "", "9-3", "3,3", "0", "128", "1-127", "\u0661", "4,,5"),
    *("080,181-18F", "181-", "800", "1FFFFFFF", "00000080-000000FF", "20000000", "7ff", "70x"),
)
PIECES: Final = (
    *("", "never", "in", "{", "}", "..", "±", "+-", "10%", "1e400", "nan", "inf", "-1", "0x"),
    *(
        "9" * 400,
        "99999999999999s",
        "0ms",
        "0.000000001us",
        "(",
        ")",
        "not",
        "!",
        "of",
        "181[",
    ),
    *("node", "128", "0", "3-1", "1-127", "[", "]", "\x00", "\udc80", "\u2028", "\n", "'", ": "),
    *("while", "after", "before", "per", "to", "dlc = 8", "#FF", "\u0661", "²", "é", "_", ".", "h"),
)
TRAFFIC: Final = tuple(
    hear(
        f"{MAPPED}1 183#370264000000\n1.1 083#3081110000000000\n1.2 603#4000100000000000\n"
        "1.3 703#R\n1.4 703#85\n1.5 080#01\n1.55 080#03\n1.6 000#0103\n1.7 703#00\n1.75 703#05\n"
        "1.8 20000020#0000000000000000\n1.9 183#3802FFFFFFFF\n2 183#38\n"
        "2.1 18FF0000#01\n2.2 181#R\n"
        "1.2 583#8000100000000206"
    )
)


def mutated(chance: Random) -> tuple[str, bytes]:
    """Return a rule, or a file of rules, with some changes."""
    rules = [_rule(chance) for _ in range(chance.randint(1, 3))]
    if chance.random() < 0.5:
        return "rule.txt", rules[0].encode("utf-8", "surrogatepass")
    head = FILE.replace("NODES", chance.choice(RANGES)).replace("KNOWN", chance.choice(RANGES))
    if chance.random() < 0.5:
        text = head + f"rule = {rules!r}\n"
    else:
        text = head + "[rule]\n" + "".join(f"r{n} = {rule!r}\n" for n, rule in enumerate(rules))
    data = text.encode("utf-8", "surrogatepass")
    return "rules.toml", spoilt(data, chance) if chance.random() < 0.7 else data


def _rule(chance: Random) -> str:
    words = chance.choice(RULES).split(" ")
    for _ in range(chance.randint(0, 3)):
        at = chance.randrange(len(words) + 1)
        match chance.randrange(5):
            case 0:
                words[at:at] = [chance.choice(PIECES)]
            case 1:
                words[at : at + 1] = [chance.choice((*PIECES, *DEMANDS))]
            case 2:
                del words[at : at + 1]
            case 3:
                words[at:] = chance.choice(RULES).split(" ")[at:]
            case _:
                joined = " ".join(words)
                cut = chance.randint(0, len(joined))
                words = f"{joined[:cut]}{chance.choice(PIECES)}{joined[cut + 1 :]}".split(" ")
    return " ".join(words)


def one_line(text: str) -> str:
    """Return that what a file says was refused, in one line."""
    assert "\n" not in text, text
    return "refused"


def judge(name: str, data: bytes) -> str:
    """Hold what was read against traffic, or see that it is refused in one line."""
    try:
        rules = parse_rules(_words(name, data))
        checker, decoder = Checker(rules), Decoder()
    except ValueError as error:
        return one_line(str(error))
    around = Surroundings(2, rules.names())
    found = []
    for record in TRAFFIC:
        decoded = decoder.take(record)
        found += around.take(record, decoded, checker.take(record, decoded))
    found += around.flush(checker.end(5_000_000))
    unjudged = checker.unjudged(5_000_000)
    assert unjudged.rules.keys() <= set(rules.names())
    for text in (*unjudged.rules.values(), *unjudged.notes):
        assert text
        one_line(text)
    for finding in found:
        assert str(finding)
        assert finding_json(finding)
        assert finding.rule in rules.names()
    return "broken" if found else "held"


def _words(name: str, data: bytes) -> RuleValues:
    if name.endswith(".toml"):
        return tomllib.loads(data.decode("utf-8"))
    return {"rule": [data.decode("utf-8", "surrogatepass")]}
