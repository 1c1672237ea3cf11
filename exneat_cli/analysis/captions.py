"""The sentences below tables and figures: what they rest on, and what they do not show."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from exneat_cli.analysis.budgets import budget_sentence, spent_in
from exneat_cli.analysis.study import Study

ENOUGH_RUNS = 10


def runs_sentence(study: Study, conditions: Sequence[str], variants: Iterable[str]) -> str:
    """Budget, and how many finished runs each variant has in the given conditions."""
    counts = [
        (study.variants[variant], sorted(len(study.of(condition, variant)) for condition in conditions))
        for variant in variants
    ]
    parts = [f"{label} {n[0]}" if n[0] == n[-1] else f"{label} {n[0]} to {n[-1]}" for label, n in counts]
    # Labels of variants may hold commas.
    return f"Budget {study.budget}; finished runs per condition: {'; '.join(parts)}."


def few_runs_sentence(fewest: float) -> str:
    """A warning if the smallest of the compared groups has fewer than ten runs, else nothing."""
    if fewest >= ENOUGH_RUNS:
        return ""
    return f"Intervals are too narrow below {ENOUGH_RUNS} runs, and a single run has none."


def interval_sentence() -> str:
    """What means and intervals are over."""
    return "Mean and interquartile mean (IQM) are over runs, and so is the 95% bootstrap interval of the mean."


def test_sentence(study: Study) -> str:
    """What p and A12 compare."""
    first = next(iter(study.variants.values()))
    return (
        f"p: two-sided Mann-Whitney U test against {first}, Holm-corrected over the trained variants of a condition. "
        f"A12: chance that a run of the variant beats a run of {first}, a tie counting half."
    )


def efficiency_sentence(study: Study) -> str:
    """What efficiency counts."""
    first = next(iter(study.variants.values()))
    return (
        "Efficiency: first generation, counted from 1, at which the mean best so far reaches the final mean of "
        f"{first}."
    )


def quantity_sentence(study: Study, quantities: Collection[str]) -> str:
    """What the quantities are, each in a few words.

    Args:
        study: whose fitness and full reward they are.
        quantities: of `QUANTITIES`, or ``full_reward``.
    """
    meanings = {
        "training": "final best so far",
        "test": "the champion on test episodes",
        "robustness": "the champion at one level of a sweep",
        "full_reward": "on test episodes, with the rewards and costs that training leaves out",
    }
    found = [f"{name.replace('_', ' ')}: {words}" for name, words in meanings.items() if name in quantities]
    fitness = "" if study.fitness_name == "fitness" else f" Fitness is {study.fitness_name}."
    return f"{'; '.join(found).capitalize()}.{fitness}" if found else fitness.strip()


def budgets_sentence(study: Study, conditions: Iterable[str], variants: Iterable[str]) -> str:
    """Whether the given variants had equal budgets in each of the given conditions."""
    compared = list(variants)
    return budget_sentence(spent_in(study, condition, compared) for condition in conditions)
