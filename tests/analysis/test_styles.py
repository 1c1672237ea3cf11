"""How variants look: told apart, and the same wherever they appear."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import exneat_cli
from exneat_cli.analysis.styles import save_figure, tick_levels, variant_styles

ANT = ("neat", "single_unlinked", "single_linked", "all_unlinked", "all_linked", "fb", "lr", "cross")
BASELINES = ("random", "motionless", "linear_fusion")


def test_a_variant_looks_the_same_whoever_stands_beside_it() -> None:
    together = variant_styles([*ANT, *BASELINES], BASELINES)
    for variant in ANT:
        assert variant_styles([variant]) == {variant: together[variant]}


def test_variants_of_one_experiment_differ_in_colour_and_in_shape() -> None:
    looks = variant_styles(ANT).values()
    assert len({look["color"] for look in looks}) == len({look["marker"] for look in looks}) == len(ANT)


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
    for name, settings in (("one", {}), ("other", {"savefig.facecolor": "red", "svg.fonttype": "none"})):
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
