"""Tables in LaTeX, with the rules of the package booktabs."""

from __future__ import annotations

import re
from collections.abc import Sequence

_ESCAPED = {
    **{character: f"\\{character}" for character in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\symbol{34}",  # \textquotedbl is unknown to LaTeX's usual font encoding, OT1
}
_NUMBER = re.compile(r"[<>+-]?\d[\d.]*")


def latex_table(title: str, caption: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    r"""Write a ``tabular`` for ``\input`` within a ``table``; needs ``\usepackage{booktabs}``.

    Numbers are aligned right, all else left, with space where the first cell changes. `caption` is a comment above.
    """
    columns = list(zip(*rows, strict=True)) or [()] * len(header)
    sides = "".join(
        "r" if any(cells) and all(map(_NUMBER.fullmatch, filter(None, cells))) else "l" for cells in columns
    )
    lines = [f"% {title}: needs \\usepackage{{booktabs}}", f"% {' '.join(caption.split())}"]
    lines += [f"\\begin{{tabular}}{{{sides}}}", r"\toprule", _row(header), r"\midrule"]
    for above, row in zip([None, *rows], rows, strict=False):
        lines += [r"\addlinespace"] if above is not None and above[0] != row[0] else []
        lines.append(_row(row))
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}", ""])


def _row(cells: Sequence[str]) -> str:
    # A bracket after a line break would be taken for its length.
    texts = [f"{{{text}}}" if text.startswith("[") else text for text in map(_text, cells)]
    return " & ".join(texts) + r" \\"


def _text(cell: str) -> str:
    if re.fullmatch(r"[\[\]\d., +-]+", cell):
        return re.sub(r"-(?=\d)", "$-$", cell)
    return "".join(_ESCAPED.get(character, character) for character in " ".join(cell.split()))
