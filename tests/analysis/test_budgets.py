"""Whether variants spent the same, and what is said about it."""

from __future__ import annotations

from pathlib import Path

from exneat_cli.analysis.budgets import Spent, budget_sentence, equal_budgets, spent_in
from tests.analysis.fake_studies import finish, plan_study, run_of, seen_anew


def spent(*episodes: int, steps: int = 1000) -> Spent:
    return Spent(episodes, (steps,) * len(episodes), (1.0,) * len(episodes))


def test_budgets_are_equal_only_if_every_run_had_exactly_the_same_episodes() -> None:
    assert equal_budgets({"NEAT": spent(400, 400), "ExNEAT": spent(400)})
    assert not equal_budgets({"NEAT": spent(400, 400), "ExNEAT": spent(401)})
    assert not equal_budgets({"NEAT": spent(400, 399), "ExNEAT": spent(400)})


def test_equal_budgets_are_said_to_be_equal_with_the_steps_of_each_variant() -> None:
    sentence = budget_sentence([{"NEAT": spent(8000, 8000, steps=1234567), "ExNEAT": spent(8000, steps=900)}])
    assert sentence == (
        "All variants had equal budgets of 8,000 training episodes per run; "
        "environment steps per run, on average: NEAT 1,234,567; ExNEAT 900."
    )


def test_unequal_budgets_are_said_to_be_unequal() -> None:
    sentence = budget_sentence([{"NEAT": spent(300, 400), "ExNEAT": spent(400)}])
    assert sentence == (
        "The variants had unequal budgets of training episodes per run (NEAT 300 to 400; ExNEAT 400); "
        "environment steps per run, on average: NEAT 1,000; ExNEAT 1,000."
    )


def test_variants_are_compared_within_conditions_not_across_them() -> None:
    short, long = {"NEAT": spent(100), "ExNEAT": spent(100)}, {"NEAT": spent(200), "ExNEAT": spent(200)}
    assert budget_sentence([short, long]).startswith("All variants had equal budgets of 100 to 200 training")
    crossed = [{"NEAT": spent(100), "ExNEAT": spent(200)}, {"NEAT": spent(200), "ExNEAT": spent(100)}]
    assert budget_sentence(crossed).startswith("The variants had unequal budgets")


def test_variants_that_never_meet_in_a_condition_are_not_called_equal() -> None:
    for conditions in ([{"NEAT": spent(100)}, {}], [{"NEAT": spent(100)}, {"ExNEAT": spent(100)}]):
        assert budget_sentence(conditions).startswith("No two variants have finished runs of the same condition")
    assert budget_sentence([{}]) == "No run has spent anything on training."


def test_what_was_spent_is_read_off_manifests_of_finished_trained_runs(tmp_path: Path) -> None:
    study = plan_study(tmp_path)
    finish(run_of(study, "calm", "neat", 0), (0.1, 0.2), episodes=40, env_steps=700)
    finish(run_of(study, "calm", "neat", 2), (0.1, 0.2), episodes=50, env_steps=800)
    finish(run_of(study, "noisy", "exneat", 0), (0.1, 0.2))
    finish(run_of(study, "calm", "random", 0))
    found = spent_in(seen_anew(study), "calm", study.variants)
    assert found == {"NEAT": Spent((40, 50), (700, 800), (90.5, 90.5))}
