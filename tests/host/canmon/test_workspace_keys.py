from __future__ import annotations

import pytest

from tickrig.host.canmon.workspace import Workspace, WorkspaceError


def test_a_key_that_is_none_is_taken_out_wherever_it_stands() -> None:
    workspace = Workspace('[t]\nkept = 1\n[[t.row]]\nsend = "080#"\nevery = "1s"\nmine = 1\n')
    workspace.put("t", {"row": [{"send": "081#", "every": None}], "rules": {"a": True, "b": None}})
    assert workspace.section("t") == {
        "kept": 1,
        "row": [{"send": "081#", "mine": 1}],
        "rules": {"a": True},
    }
    workspace.put("t", {"row": [{"send": "081#"}, {"send": "082#", "every": None}]})
    assert workspace.section("t")["row"][1] == {"send": "082#"}


def test_tables_that_are_there_twice_are_refused() -> None:
    with pytest.raises(WorkspaceError, match="item"):
        Workspace("[t]\n[[t.item]]\na = 1\n[u]\n[t.item.x]\n")
