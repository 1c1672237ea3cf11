"""How variants look: told apart, and the same wherever they appear."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import exneat_cli
from exneat_cli.analysis.network_graph import NEGATIVE, POSITIVE
from exneat_cli.analysis.styles import Paper, read_style_sheet, save_figure, tick_levels, variant_styles
from exneat_cli.errors import ExneatError

ANT = ("neat", "single_unlinked", "single_linked", "all_unlinked", "all_linked", "fb", "lr", "cross")
BASELINES = ("random", "motionless", "linear_fusion")

COLOUR_BLIND = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.3039]],
}
"""What is left of linear RGB, at full severity: Machado, Oliveira and Fernandes (2009), table 1."""


def lab(colour: str, blindness: str | None = None) -> np.ndarray:
    """CIE L*a*b* (D65) of a colour, as it is seen."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    if blindness:
        linear = np.clip(np.array(COLOUR_BLIND[blindness]) @ linear, 0.0, 1.0)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    x, y, z = np.cbrt(np.maximum(to_xyz @ linear / [0.9505, 1.0, 1.089], 216 / 24389))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_a_variant_looks_the_same_whoever_stands_beside_it() -> None:
    together = variant_styles([*ANT, *BASELINES], BASELINES)
    for variant in ANT:
        assert variant_styles([variant]) == {variant: together[variant]}


def test_variants_of_one_experiment_differ_in_colour_and_in_shape() -> None:
    looks = variant_styles(ANT).values()
    assert len({look["color"] for look in looks}) == len({look["marker"] for look in looks}) == len(ANT)


@pytest.mark.parametrize("blindness", [None, *COLOUR_BLIND])
def test_variants_are_told_apart_with_every_kind_of_colour_vision(blindness: str | None) -> None:
    colours = [look["color"] for look in variant_styles(ANT).values()]
    seen = [lab(colour, blindness) for colour in colours]
    nearest = min(np.linalg.norm(seen[i] - seen[k]) for i in range(len(seen)) for k in range(i))
    assert nearest > 10.0  # four times what is just noticed


def test_in_grey_variants_differ_by_shape_and_dashes_and_weights_by_lightness() -> None:
    many = [*ANT, *(f"variant_{k}" for k in range(8))]
    looks = variant_styles(many).values()
    assert len({(look["marker"], look["linestyle"]) for look in looks}) == len(many)
    assert lab(NEGATIVE)[0] - lab(POSITIVE)[0] > 25.0


def test_baselines_are_grey_lines_without_points_that_differ_in_their_dashes() -> None:
    looks = [variant_styles([*ANT, *BASELINES], BASELINES)[name] for name in BASELINES]
    assert all(len(set(to_rgb(look["color"]))) == 1 and not look["marker"] for look in looks)
    assert len({str(look["linestyle"]) for look in looks} | {"-", "--"}) == len(BASELINES) + 2


def test_variants_of_a_users_own_take_colours_that_are_still_free() -> None:
    looks = variant_styles(["neat", "mine", "all_linked", "yours", "lazy"], ["lazy"])
    assert len({looks[name]["color"] for name in ("neat", "mine", "all_linked", "yours")}) == 4
    assert looks["lazy"]["linestyle"] != "-"
    many = [f"variant_{k}" for k in range(30)]
    assert set(variant_styles(many)) == set(many)


def test_an_axis_of_whole_levels_has_no_ticks_between_them() -> None:
    tiles, shares = Figure().subplots(1, 2)
    for axes, levels in ((tiles, [2.0, 3.0, 4.0]), (shares, [0.0, 0.5, 1.0])):
        axes.plot(levels, levels)
        tick_levels(axes, levels)
    assert all(tick.is_integer() for tick in tiles.get_xticks())
    assert not all(tick.is_integer() for tick in shares.get_xticks())


def test_settings_of_a_users_own_change_no_figure(tmp_path: Path) -> None:
    for name, settings in (("one", {}), ("other", {"savefig.facecolor": "red", "svg.fonttype": "path"})):
        with mpl.rc_context(settings):
            save_figure(Figure(), tmp_path / name)
    for kind in ("png", "svg"):
        assert (tmp_path / f"one.{kind}").read_bytes() == (tmp_path / f"other.{kind}").read_bytes()


@pytest.mark.parametrize("backend", ["module://matplotlib_inline.backend_inline", "nonsense", None])
def test_a_backend_that_is_not_there_is_done_without_and_settings_that_cannot_be_read_are_named(
    backend: str | None, tmp_path: Path
) -> None:
    if backend is None:
        (tmp_path / "matplotlibrc").write_bytes(b"\xff\xfe")
    code = f"import exneat_cli.analysis, os; assert os.environ.get('MPLBACKEND') == {backend!r}"
    environment = {key: value for key, value in os.environ.items() if key != "MPLBACKEND"}
    environment |= {"MPLBACKEND": backend} if backend else {}
    environment["PYTHONPATH"] = str(Path(exneat_cli.__file__).parents[1])
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == (backend is None), done.stderr
    assert ("ExneatError: matplotlib cannot be loaded: 'utf-8' codec" in done.stderr) == (backend is None)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"font.siz: 7", "font.siz: matplotlib has no such setting\n  did you mean font.size?"),
        (b"font.size: large\nlines.linewidth: thick", "matplotlib does not accept a value"),
        (b"\xff\xfe", "it is not UTF-8 text"),
        (None, "No such file or directory"),
    ],
)
def test_a_style_sheet_that_makes_no_sense_is_refused_in_at_most_three_lines(
    tmp_path: Path, content: bytes | None, message: str
) -> None:
    sheet = tmp_path / "mine.mplstyle"
    if content is not None:
        sheet.write_bytes(content)
    with pytest.raises(ExneatError) as refused:
        read_style_sheet(sheet)
    assert message in str(refused.value)
    assert len(str(refused.value).splitlines()) <= 3


def test_a_style_that_cannot_be_drawn_here_is_named(tmp_path: Path) -> None:
    paper, figure = Paper(sheet={"text.usetex": True, "text.latex.preamble": r"\nonsense"}), Figure()
    with paper.style():
        figure.suptitle("text")
    with pytest.raises(ExneatError, match="cannot be drawn with this style="):
        save_figure(figure, tmp_path / "figure", paper)
