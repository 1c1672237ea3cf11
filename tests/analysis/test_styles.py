"""How variants look: told apart, and the same wherever they appear."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

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
