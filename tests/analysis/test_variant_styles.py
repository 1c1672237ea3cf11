"""How variants look: told apart, and the same wherever they appear."""

from __future__ import annotations

from matplotlib.colors import to_rgb

from exneat_cli.analysis.variant_styles import variant_styles

ANT = ("neat", "single_unlinked", "single_linked", "all_unlinked", "all_linked", "fb", "lr", "cross")
BASELINES = ("random", "motionless", "linear_fusion")


def test_an_variant_looks_the_same_whoever_stands_beside_it() -> None:
    together = variant_styles([*ANT, *BASELINES], BASELINES)
    for variant in ANT:
        assert variant_styles([variant]) == {variant: together[variant]}
    assert variant_styles(["exneat", "neat"])["neat"] == together["neat"]


def test_variants_of_one_experiment_differ_in_colour_and_in_shape() -> None:
    styles = variant_styles(ANT).values()
    assert len({style.colour for style in styles}) == len(ANT)
    assert len({style.marker for style in styles}) == len(ANT)


def test_baselines_are_grey_lines_without_points_that_differ_in_their_dashes() -> None:
    styles = [variant_styles([*ANT, *BASELINES], BASELINES)[name] for name in BASELINES]
    assert all(len(set(to_rgb(style.colour))) == 1 and not style.marker for style in styles)
    assert len({str(style.line) for style in styles} | {"-", "--"}) == len(BASELINES) + 2


def test_variants_of_a_users_own_take_colours_that_are_still_free() -> None:
    styles = variant_styles(["neat", "mine", "all_linked", "yours", "lazy"], ["lazy"])
    assert len({styles[name].colour for name in ("neat", "mine", "all_linked", "yours")}) == 4
    assert styles["lazy"].line != "-"
    assert styles == variant_styles(["neat", "mine", "all_linked", "yours", "lazy"], ["lazy"])


def test_more_variants_than_colours_still_get_one_each() -> None:
    names = [f"variant_{k}" for k in range(30)]
    assert set(variant_styles(names)) == set(names)
