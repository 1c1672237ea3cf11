"""What runs spent on training, and whether variants that are compared spent the same."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from exneat_cli.analysis.study import Study


@dataclass(frozen=True)
class Spent:
    """What the runs of one variant spent; one entry per run in each.

    Attributes:
        episodes, env_steps: of training.
        wall_seconds: time that training took.
    """

    episodes: tuple[int, ...]
    env_steps: tuple[int, ...]
    wall_seconds: tuple[float, ...]


def spent_in(study: Study, condition: str, variants: Iterable[str]) -> dict[str, Spent]:
    """What the finished runs of each variant spent, by label; baselines and variants without any are left out."""
    found = {}
    for variant in variants:
        manifests = [run.directory.read_manifest() for run in study.of(condition, variant)]
        budgets = [manifest.budget_spent for manifest in manifests if manifest.budget_spent]
        if budgets:
            columns = [tuple(b[key] for b in budgets) for key in ("episodes", "env_steps", "wall_seconds")]
            found[study.variants[variant]] = Spent(*columns)  # type: ignore[arg-type]
    return found


def equal_budgets(spent: Mapping[str, Spent]) -> bool:
    """Whether all runs of all variants had exactly the same number of training episodes."""
    return len({episodes for each in spent.values() for episodes in each.episodes}) <= 1


def budget_sentence(conditions: Iterable[Mapping[str, Spent]]) -> str:
    """Says whether variants had equal budgets, and how many environment steps each took.

    Episodes are what a budget sets; steps follow from how long a variant's episodes last, so variants with equal
    budgets differ in them.

    Args:
        conditions: of each condition, what each variant spent, by label. Variants are compared within conditions.
    """
    shown = [spent for spent in conditions if spent]
    episodes: dict[str, list[int]] = {}
    steps: dict[str, list[int]] = {}
    for spent in shown:
        for variant, each in spent.items():
            episodes.setdefault(variant, []).extend(each.episodes)
            steps.setdefault(variant, []).extend(each.env_steps)
    if not shown:
        return "No run has spent anything on training."
    compared = [spent for spent in shown if len(spent) > 1]
    if not compared:
        verdict = "No two variants have finished runs of the same condition, so there are no budgets to compare"
    elif all(equal_budgets(spent) for spent in compared):
        every = _range([count for counts in episodes.values() for count in counts])
        verdict = f"All variants had equal budgets of {every} training episodes per run"
    else:
        each_variant = "; ".join(f"{variant} {_range(counts)}" for variant, counts in episodes.items())
        verdict = f"The variants had unequal budgets of training episodes per run ({each_variant})"
    # Labels of variants may hold commas.
    means = "; ".join(f"{variant} {sum(counts) / len(counts):,.0f}" for variant, counts in steps.items())
    return f"{verdict}; environment steps per run, on average: {means}."


def _range(counts: list[int]) -> str:
    low, high = min(counts), max(counts)
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"
