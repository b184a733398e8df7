from __future__ import annotations

import pytest

from tickrig.host.text.toml_place import line_of

TEXT = '''\
# a comment with [[step]]
name = """
[[step]]
"""

[[step]]
send = "000#"

[[step]]
repeat = 2
steps = [
  { send = "080#" },
  { wait = "10ms", also = [1,
     2] },
]

[vars]
id = 3
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("name",), 4),
        (("step", 0), 6),
        (("step", 0, "send"), 7),
        (("step", 1), 9),
        (("step", 1, "steps", 0), 12),
        (("step", 1, "steps", 1, "also", 1), 14),
        (("vars", "id"), 18),
        (("nowhere",), 1),
    ],
)
def test_a_value_is_found_where_it_stands(path: tuple[str | int, ...], line: int) -> None:
    assert line_of(TEXT, path) == line
