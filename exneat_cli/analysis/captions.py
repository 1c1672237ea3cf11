"""The sentences below tables and figures: what they rest on, and what they do not show."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

import pandas as pd

from exneat_cli.analysis.study import Study

ENOUGH_RUNS = 10
_MEANINGS = {
    "training": "final best so far",
    "test": "the champion on test episodes",
    "robustness": "the champion at one level of a sweep",
    "full_reward": "on test episodes, with the rewards and costs that training leaves out",
}


def table_sentences(study: Study, lines: pd.DataFrame, quantities: Collection[str]) -> Iterable[str]:
    """Say what a table rests on and what its columns, some of `QUANTITIES`, mean.

    `lines` are those of the study's summary that it shows, maybe with a column ``published``.
    """
    conditions, variants = list(lines["condition"].unique()), list(lines["variant"].unique())
    is_published = "published" in lines and bool((lines["published"] != "").any())
    first = study.variants[study.first_variant]
    counts = {variant: [len(study.of(condition, variant)) for condition in conditions] for variant in variants}
    # Labels of variants may hold commas.
    listed = "; ".join(f"{study.variants[variant]} {_range(runs)}" for variant, runs in counts.items())
    yield f"Budget {study.budget}; finished runs per condition: {listed}."
    if is_published and study.budget != "paper":
        yield "The published figures rest on a larger budget."
    if meanings := [f"{name.replace('_', ' ')}: {words}" for name, words in _MEANINGS.items() if name in quantities]:
        yield f"{'; '.join(meanings).capitalize()}."
    if study.fitness_name != "fitness":
        yield f"Fitness is {study.fitness_name}."
    yield "Mean and interquartile mean (IQM) are over runs, and so is the 95% bootstrap interval of the mean."
    yield few_runs_sentence(lines.loc[lines["variant"].isin(study.trained_variants) & (lines["runs"] > 0), "runs"])
    yield f"p: two-sided Mann-Whitney U test against {first}, Holm-corrected over the trained variants of a condition."
    yield f"A12: chance that a run of the variant beats a run of {first}, a tie counting half."
    if "efficiency" in quantities:
        reached = "first generation, counted from 1, at which the mean best so far reaches the final mean of"
        yield f"Efficiency: {reached} {first}."
        yield "Published efficiencies are not exactly comparable." if is_published else ""
    yield budget_sentence([spent_in(study, condition, variants) for condition in conditions])


def few_runs_sentence(groups: Iterable[int]) -> str:
    """Warn if the smallest of the compared groups of runs has fewer than ten; else say nothing."""
    if min(groups, default=ENOUGH_RUNS) >= ENOUGH_RUNS:
        return ""
    return f"Intervals are too narrow below {ENOUGH_RUNS} runs, and a single run has none."


def spent_in(study: Study, condition: str, variants: Collection[str]) -> pd.DataFrame:
    """What training took in one condition: a row per run with the variant's label, episodes and env_steps."""
    results = study.results
    here = results[(results["condition"] == condition) & results["variant"].isin(list(variants))]
    labelled = here.assign(variant=here["variant"].map(study.variants))
    return labelled[["variant", "episodes", "env_steps"]].dropna()


def budget_sentence(places: Sequence[pd.DataFrame]) -> str:
    """Say whether variants had equal budgets, and how many environment steps each took.

    Variants are compared within each of `places`, which are tables of `spent_in`. Episodes are what a budget sets;
    steps follow from how long a variant's episodes last, so variants with equal budgets differ in them.
    """
    spent = pd.concat(places) if places else pd.DataFrame()
    if spent.empty:
        return "No run has spent anything on training."
    by_variant = spent.groupby("variant", sort=False)
    compared = [place["episodes"].nunique() for place in places if place["variant"].nunique() > 1]
    if not compared:
        verdict = "No two variants have finished runs of the same condition, so there are no budgets to compare"
    elif max(compared) == 1:
        verdict = f"All variants had equal budgets of {_range(spent['episodes'])} training episodes per run"
    else:
        each = "; ".join(f"{variant} {_range(counts)}" for variant, counts in by_variant["episodes"])
        verdict = f"The variants had unequal budgets of training episodes per run ({each})"
    means = "; ".join(f"{variant} {steps:,.0f}" for variant, steps in by_variant["env_steps"].mean().items())
    return f"{verdict}; environment steps per run, on average: {means}."


def _range(counts: Iterable[float]) -> str:
    low, high = min(counts), max(counts)
    return f"{low:,.0f}" if low == high else f"{low:,.0f} to {high:,.0f}"
