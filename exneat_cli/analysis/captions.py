"""The text below a table: what it rests on, what its columns mean, and what its numbers cannot show."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import pandas as pd

from exneat_cli.analysis.statistics import least_p
from exneat_cli.analysis.study import Study, budget_sentence, few_runs_sentence, number_range

SIGNIFICANT = 0.05
"""If the fewest runs of a table cannot reach a p below this, its caption says so."""
_MEANINGS = {
    "training": "final best so far",
    "test": "the champion on test episodes",
    "robustness": "the champion at one level of a sweep",
    "full_reward": "on test episodes, with the rewards and costs that training leaves out",
}


def table_sentences(study: Study, lines: pd.DataFrame, quantities: Collection[str]) -> Iterable[str]:
    """What a table rests on and what its columns, some of `QUANTITIES`, mean.

    `lines` are those of the study's summary that it shows, with or without a column ``published``.
    """
    conditions, variants = list(lines["condition"].unique()), list(lines["variant"].unique())
    is_published = "published" in lines and bool((lines["published"] != "").any())
    counts = {variant: [len(study.of(condition, variant)) for condition in conditions] for variant in variants}
    # Labels of variants may hold commas.
    listed = "; ".join(f"{study.variants[variant]} {number_range(runs)}" for variant, runs in counts.items())
    yield f"Budget {study.budget}; finished runs per condition: {listed}."
    if taken := sum(run.condition in conditions and run.variant in variants for run in study.published):
        yield f"{taken} of these runs are published rows of experiments/results."
    if is_published and study.budget != "paper":
        yield "The published figures rest on a larger budget."
    if meanings := [f"{name.replace('_', ' ')}: {words}" for name, words in _MEANINGS.items() if name in quantities]:
        yield f"{'; '.join(meanings).capitalize()}."
    if study.fitness_name != "fitness":
        yield f"Fitness is {study.fitness_name}."
    yield "Mean, interquartile mean (IQM) and the 95% bootstrap interval of the mean are over runs."
    learned = lines[lines["variant"].isin(study.trained_variants) & (lines["runs"] > 0)]
    yield few_runs_sentence(learned["runs"])
    yield _least_p_sentence(study, learned)
    yield f"{_references_sentence(study, variants)}: margin is the difference of the means."
    yield "p: two-sided Mann-Whitney U test, Holm-corrected over the compared variants of a condition."
    yield "A12: probability that a run of the variant beats a run of its reference, with ties counting half."
    if "efficiency" in quantities:
        reached = "first generation, counted from 1, at which the mean best so far reaches the final mean of"
        yield f"Efficiency: {reached} the reference."
        yield "Published efficiencies are not exactly comparable." if is_published else ""
    yield _margins_sentence(study, learned)
    yield budget_sentence([study.spent_in(condition, variants) for condition in conditions])


def _references_sentence(study: Study, variants: Iterable[str]) -> str:
    """Who is compared with whom."""
    others = [name for name in variants if name in study.references]
    each = "; ".join(f"{study.variants[name]} with {study.variants[study.references[name]]}" for name in others)
    named = f", {each}" if each else ""
    return f"Variants are compared with {study.variants[study.first_variant]}{named}"


def _least_p_sentence(study: Study, learned: pd.DataFrame) -> str:
    """Say so if there are too few runs for any difference to become significant."""
    places = [tuple(map(str, place)) for place in learned[["condition", "variant", "quantity"]].to_numpy()]
    counts = dict(zip(places, learned["runs"].astype(int), strict=True))
    least: dict[tuple[int, int], float] = {}
    for (condition, variant, quantity), runs in counts.items():
        reference = study.reference_of(variant)
        others = counts.get((condition, reference, quantity), 0)
        if reference != variant and others:
            least[runs, others] = least_p(runs, others)
    if not least or max(least.values()) < SIGNIFICANT:
        return ""
    fewest = max(least, key=lambda pair: (least[pair], pair))
    return f"With {fewest[0]} runs against {fewest[1]}, p cannot be below {least[fewest]:.2g}, whatever the results."


def _margins_sentence(study: Study, learned: pd.DataFrame) -> str:
    """The margin over each reference, where there are several, as means over conditions."""
    if not any(study.reference_of(name) not in (name, study.first_variant) for name in learned["variant"]):
        return ""
    said = []
    for quantity in ("training", "test"):
        margins = learned[learned["quantity"] == quantity].groupby("variant", sort=False)["margin"].mean().dropna()
        pairs = []
        for variant, margin in zip(map(str, margins.index), margins, strict=True):
            pairs.append(f"{study.variants[variant]} {margin:+.3f} over {study.variants[study.reference_of(variant)]}")
        said += [f"{quantity} {'; '.join(pairs)}"] if pairs else []
    return f"Margins, as means over the conditions: {', '.join(said)}." if said else ""
