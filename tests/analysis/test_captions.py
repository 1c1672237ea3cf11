"""What is said about budgets."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from exneat_cli.analysis.captions import budget_sentence, spent_in
from tests.analysis.fake_studies import finish, plan_study, run_of


def spent(**episodes: list[int]) -> pd.DataFrame:
    """What the runs of each variant spent in one condition: 10 steps in each episode."""
    rows = [(variant, count, 10 * count) for variant, counts in episodes.items() for count in counts]
    return pd.DataFrame(rows, columns=["variant", "episodes", "env_steps"])


def test_equal_budgets_are_said_to_be_equal_with_the_steps_of_each_variant() -> None:
    assert budget_sentence([spent(NEAT=[8000, 8000], ExNEAT=[8000])]) == (
        "All variants had equal budgets of 8,000 training episodes per run; "
        "environment steps per run, on average: NEAT 80,000; ExNEAT 80,000."
    )


def test_budgets_are_unequal_if_a_single_run_had_other_episodes() -> None:
    assert budget_sentence([spent(NEAT=[300, 400], ExNEAT=[400])]) == (
        "The variants had unequal budgets of training episodes per run (NEAT 300 to 400; ExNEAT 400); "
        "environment steps per run, on average: NEAT 3,500; ExNEAT 4,000."
    )


def test_variants_are_compared_within_conditions_not_across_them() -> None:
    short, long = spent(NEAT=[100], ExNEAT=[100]), spent(NEAT=[200], ExNEAT=[200])
    assert budget_sentence([short, long]).startswith("All variants had equal budgets of 100 to 200 training")
    crossed = [spent(NEAT=[100], ExNEAT=[200]), spent(NEAT=[200], ExNEAT=[100])]
    assert budget_sentence(crossed).startswith("The variants had unequal budgets")


def test_variants_that_never_meet_in_a_condition_are_not_called_equal() -> None:
    for conditions in ([spent(NEAT=[100]), spent()], [spent(NEAT=[100]), spent(ExNEAT=[100])]):
        assert budget_sentence(conditions).startswith("No two variants have finished runs of the same condition")
    for nothing in ([], [spent()]):
        assert budget_sentence(nothing) == "No run has spent anything on training."


def test_what_was_spent_is_that_of_finished_trained_runs(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", "neat", 0), (0.1, 0.2), episodes=40, env_steps=700)
    finish(run_of(study, "calm", "neat", 2), (0.1, 0.2), episodes=50, env_steps=800)
    finish(run_of(study, "noisy", "exneat", 0), (0.1, 0.2))
    finish(run_of(study, "calm", "random", 0))
    assert spent_in(study, "calm", study.variants).to_numpy().tolist() == [["NEAT", 40, 700], ["NEAT", 50, 800]]
