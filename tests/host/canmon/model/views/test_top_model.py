from __future__ import annotations

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.top_model import RowOrder, TopModel


def top(text: str) -> TopModel:
    model = TopModel()
    model.take(hear(text))
    return model


def shown(model: TopModel, height: int = 24) -> str:
    return "\n".join(model.lines(10_000_000, 0, 120, height))


def press(model: TopModel, keys: str) -> None:
    for key in keys:
        model.press(key)


def test_space_holds_the_picture_while_frames_are_counted() -> None:
    model = top("0 181#00")
    shown(model)
    press(model, " ")
    model.take(hear("1 181#01"))
    assert "can0: 1 frames" in shown(model)
    assert ", held" in shown(model)
    press(model, " ")
    assert "can0: 2 frames" in shown(model)


def test_b_shows_bits_and_bytes_again() -> None:
    model = top("0 181#00")
    press(model, "b")
    assert "········" in shown(model)
    press(model, "b")
    assert "········" not in shown(model)


def test_n_hides_what_has_changed() -> None:
    model = top("0 181#00\n1 181#01")
    press(model, "b")
    assert "·······\x1b[7m█" in shown(model)
    press(model, "n")
    assert shown(model).endswith(" ·······")
    model.take(hear("2 181#03"))
    assert shown(model).endswith(" ······\x1b[7m▄\x1b[0m")


def test_s_goes_round_the_orders() -> None:
    model = top("0 181#00")
    seen = []
    for _ in range(len(RowOrder) + 1):
        seen.append(model.view.order)
        press(model, "s")
    assert seen == [*RowOrder, RowOrder.ID]


def test_c_begins_anew() -> None:
    model = top("0 181#00")
    press(model, "c")
    assert "0 identifiers" in shown(model)


def test_scrolling_stops_at_both_ends() -> None:
    model = top("\n".join(f"0 {0x181 + n:03X}#" for n in range(15)))
    press(model, "k")
    assert model.view.top == 0
    press(model, "jf")
    assert shown(model).splitlines()[3].startswith("18C")
    press(model, "f")
    assert model.view.top == 14
    press(model, "p")
    assert model.view.top == 4


def test_the_final_table_has_all_rows_without_styles() -> None:
    model = top("\n".join(f"{n} {0x181 + n % 50:03X}#{n:02X}" for n in range(100)))
    press(model, "j")
    lines = model.final(7)
    assert len(lines) == 3 + 50
    assert lines[1].startswith("lost 7")
    assert "\x1b" not in "".join(lines)
    assert "quit" not in lines[1]
