"""Studies whose runs are made up: directories with the files that tables and pages read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from exneat_cli.analysis.study import PlannedRun, Study
from exneat_cli.records import DONE, HistoryRow, RunDirectory, write_csv, write_history, write_json
from exneat_cli.records.history import COLUMNS

Levels = Mapping[tuple[str, float], tuple[float, float]]
"""(sweep, level) -> mean fitness and mean full reward."""


def history_row(*figures: float) -> HistoryRow:
    """A row of history.csv, in the order of its columns."""
    return dict(zip(COLUMNS, figures, strict=True))


def plan_study(
    directory: Path,
    *,
    variants: Mapping[str, str] | None = None,
    baselines: Sequence[str] = ("random",),
    conditions: Mapping[str, str] | None = None,
    seeds: int = 3,
    experiment: str = "track",
    budget: str = "quick",
    has_full_reward: bool = False,
) -> Study:
    """A study none of whose runs is finished."""
    variants = variants or {"neat": "NEAT", "exneat": "ExNEAT", "random": "random actions"}
    conditions = conditions or {"calm": "no noise", "noisy": "much noise"}
    runs = tuple(
        PlannedRun(condition, variant, seed, RunDirectory(directory / experiment / f"{condition}-{variant}-s{seed}"))
        for condition in conditions
        for variant in variants
        for seed in range(1 if variant in baselines else seeds)
    )
    return Study(
        experiment=experiment,
        budget=budget,
        claim="Small networks learn faster.",
        command=f"exneat sweep experiment={experiment} budget={budget}",
        fitness_name="fitness",
        has_full_reward=has_full_reward,
        variants=variants,
        baselines=tuple(baselines),
        conditions=conditions,
        sweeps={"sensor_noise": "sensor noise (sd)"},
        runs=runs,
    )


def finish(
    run: PlannedRun,
    curve: Sequence[float] = (),
    *,
    test: float = 0.5,
    full_reward: float = 0.5,
    validation: float = 0.5,
    levels: Levels | None = None,
    episodes: int = 400,
    env_steps: int = 9000,
    versions: Mapping[str, str] | None = None,
) -> None:
    """Write what a finished run leaves; without a curve it is that of a baseline."""
    directory = run.directory
    directory.path.mkdir(parents=True)
    champion = {"episodes": 20, "fitness_mean": test, "fitness_std": 0.1, "full_reward_mean": full_reward}
    manifest: dict[str, object] = {
        "status": DONE,
        "variant": run.variant,
        "seed": run.seed,
        "versions": dict(versions or {"exneat": "0.1.0", "numpy": "2.4.6"}),
    }
    result: dict[str, object] = {"champion": champion}
    if curve:
        write_history(
            directory.history,
            [history_row(g, b, b, b, b, g, g, 1, 9, 0, 0, 0, 0.1 * g) for g, b in enumerate(curve, start=1)],
        )
        manifest["budget_spent"] = {"episodes": episodes, "env_steps": env_steps, "wall_seconds": 90.5}
        result = {"training": curve[-1], "validation": validation, **result}
    if levels is not None:
        rows = [(run.variant, run.seed, *place, 20, f, 0.0, full, 0.0) for place, (f, full) in levels.items()]
        columns = ("variant", "run_seed", "parameter", "level", "episodes", "fitness_mean", "fitness_std")
        write_csv(directory.robustness, (*columns, "full_reward_mean", "full_reward_std"), rows)
    write_json(directory.manifest, {**manifest, "result": result})


def finish_all(study: Study, levels: Levels | None = None) -> Study:
    """Finish every run: later variants and seeds do better; returns a study that sees them."""
    rank = {variant: k for k, variant in enumerate(study.variants)}
    for run in study.runs:
        end = 0.3 + 0.1 * rank[run.variant] + 0.013 * run.seed
        curve = () if run.variant in study.baselines else (0.5 * end, end, end)
        finish(run, curve, test=end - 0.05, full_reward=end + 1.0, validation=end, levels=levels)
    return seen_anew(study)


def seen_anew(study: Study) -> Study:
    """The same study without what it remembers of its runs."""
    return Study(**{name: getattr(study, name) for name in Study.__dataclass_fields__})


def run_of(study: Study, condition: str, variant: str, seed: int) -> PlannedRun:
    """One planned run."""
    return next(run for run in study.runs if (run.condition, run.variant, run.seed) == (condition, variant, seed))
