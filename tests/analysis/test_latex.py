"""Tables in LaTeX, read back cell by cell."""

from __future__ import annotations

import re

import pytest

from exneat_cli.analysis.latex import latex_table

SPECIAL = r"\ & % $ # _ { } ~ ^"


def cells_of(text: str) -> list[list[str]]:
    """The rows between the rules, by cells; an ampersand with a backslash parts none."""
    lines = [line for line in text.splitlines() if line.endswith(r" \\")]
    return [re.split(r" (?<!\\)& ", line.removesuffix(r" \\")) for line in lines]


def test_numbers_stand_right_text_left_and_conditions_apart() -> None:
    rows = [("calm", "a", "0.5", "[-1, 2]"), ("calm", "b", "<0.001", ""), ("windy", "a", "-3", "[0, 1]")]
    text = latex_table("table-1", "A caption.\nOf two lines.", ("condition", "variant", "p", "interval"), rows)
    lines = text.splitlines()
    assert lines[1] == "% A caption. Of two lines."
    assert lines[2] == r"\begin{tabular}{llrl}"
    assert [line for line in lines if line.endswith("rule")] == [r"\toprule", r"\midrule", r"\bottomrule"]
    assert lines.index(r"\addlinespace") == lines.index(r"calm & b & \textless{}0.001 &  \\") + 1
    assert cells_of(text)[1] == ["calm", "a", "0.5", "{[$-$1, 2]}"]
    assert cells_of(text)[3] == ["windy", "a", "$-$3", "{[0, 1]}"]


@pytest.mark.parametrize("label", [SPECIAL, "a|b", "x\ny", 'say "so"'])
def test_what_latex_would_take_for_commands_is_text(label: str) -> None:
    text = latex_table("t", "", (label,), [(label,)])
    (header,), (cell,) = cells_of(text)
    assert header == cell
    bare = re.sub(r"\\text\w+\{\}|\\symbol\{34\}|\\[&%$#_{}]", "", cell)
    assert not set(bare) & set(r"\&%$#_{}~^<>|" + '"\n')


def test_a_table_without_rows_is_a_table() -> None:
    assert r"\begin{tabular}{ll}" in latex_table("t", "", ("a", "b"), [])
