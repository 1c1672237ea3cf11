"""Studies whose runs are made up: every number comes from a formula, and nothing is trained."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import matplotlib.image
import numpy as np

from exneat_cli.analysis.study import PlannedRun, Study
from exneat_cli.records import (
    DONE,
    MANIFEST_FORMAT,
    RobustnessRow,
    RunDirectory,
    merge_robustness,
    write_history,
    write_json,
)
from exneat_cli.records.tables import COLUMNS
from tests.analysis.fake_champions import a_score, grid_champion, modular_champion

Levels = Mapping[tuple[str, float], tuple[float, float]]
"""(sweep, level) -> mean fitness and mean full reward."""
LEVELS = tuple(round(0.1 * k, 1) for k in range(6))
SWEEPS = {"sensor_noise": "sensor noise (sd)", "gap": "gap before the goal (tiles)"}
CONDITIONS = {"calm": "no noise", "noisy": "much noise"}
VARIANTS = {"neat": "NEAT", "exneat": "ExNEAT", "random": "random actions"}


def plan_study(
    directory: Path,
    *,
    variants: Mapping[str, str] = VARIANTS,
    baselines: Sequence[str] = ("random",),
    conditions: Mapping[str, str] = CONDITIONS,
    seeds: int = 3,
    experiment: str = "track",
    has_full_reward: bool = False,
    references: Mapping[str, str] | None = None,
) -> Study:
    """A study none of whose runs is finished."""
    runs = tuple(
        PlannedRun(condition, variant, seed, RunDirectory(directory / experiment / f"{condition}-{variant}-s{seed}"))
        for condition in conditions
        for variant in variants
        for seed in range(1 if variant in baselines else seeds)
    )
    return Study(
        experiment=experiment,
        budget="quick",
        claim="Small networks learn faster.",
        command=f"exneat sweep experiment={experiment} budget=quick",
        fitness_name="forward reward" if has_full_reward else "fitness",
        has_full_reward=has_full_reward,
        variants=variants,
        baselines=tuple(baselines),
        conditions=conditions,
        sweeps=SWEEPS,
        runs=runs,
        references=references or {},
    )


def history_row(*figures: float) -> dict[str, int | float]:
    """A row of history.csv, in the order of its columns."""
    return dict(zip(COLUMNS, figures, strict=True))


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
    version: str = "0.1.0",
) -> None:
    """Write what a finished run leaves; without a curve it is that of a baseline."""
    directory = run.directory
    directory.path.mkdir(parents=True)
    result: dict[str, object] = {"champion": a_score(test, full_reward), "standing_still": a_score(0.0, 0.0)}
    manifest: dict[str, object] = {
        "format": MANIFEST_FORMAT,
        "status": DONE,
        "variant": run.variant,
        "task": "made_up",
        "seed": run.seed,
        "configuration_hash": "0",
        "generations": len(curve),
        "versions": {"exneat": version, "numpy": "2.4.6"},
    }
    if curve:
        per_generation = env_steps // len(curve)
        rows = [
            history_row(g, b, b, b, b, 10 * g, (per_generation + run.seed) * g, 1, 9, 0, 0, 0, 0.1 * g)
            for g, b in enumerate(curve, start=1)
        ]
        write_history(directory.history, rows)
        write_json(directory.champion, grid_champion() if run.variant == "neat" else modular_champion())
        manifest["budget_spent"] = {"episodes": episodes, "env_steps": env_steps, "wall_seconds": 90.5}
        result |= {"training": curve[-1], "validation": validation}
    if levels is not None:
        swept = [RobustnessRow(run.variant, run.seed, *at, 20, f, 0.1, full, 0.1) for at, (f, full) in levels.items()]
        merge_robustness(directory.robustness, swept)
    write_json(directory.manifest, {**manifest, "result": result})


def finish_all(study: Study, levels: Levels | Callable[[float], Levels] | None = None) -> Study:
    """Finish every run: later variants and seeds do better; returns the study as it then is.

    `levels` may depend on how good a run is in the end.
    """
    rank = {variant: k for k, variant in enumerate(study.variants)}
    for run in study.runs:
        end = 0.3 + 0.1 * rank[run.variant] + 0.013 * run.seed
        curve = () if run.variant in study.baselines else tuple(end * share for share in (0.4, 0.7, 0.9, 1.0))
        own = levels(end) if callable(levels) else levels
        finish(run, curve, test=end - 0.05, full_reward=end + 1.0, validation=end, levels=own)
    return replace(study)


def falling(height: float) -> Levels:
    """All levels of all sweeps: fitness falls with the level, and full reward is twice as high."""
    heights = {(sweep, level): height * (1.0 - level) for sweep in SWEEPS for level in LEVELS}
    return {place: (fitness, 2 * fitness) for place, fitness in heights.items()}


def a_study(directory: Path, **options: Any) -> Study:
    """All runs finished, with all levels."""
    return finish_all(plan_study(directory, **options), falling)


def run_of(study: Study, condition: str, variant: str, seed: int) -> PlannedRun:
    """One planned run."""
    return next(run for run in study.runs if (run.condition, run.variant, run.seed) == (condition, variant, seed))


def contents(directory: Path) -> dict[str, bytes]:
    """Every file below a directory."""
    return {str(path.relative_to(directory)): path.read_bytes() for path in directory.rglob("*") if path.is_file()}


def has_white_edges(path: Path) -> bool:
    """Whether nothing in a PNG is cut off: its outermost pixels are all white."""
    picture = matplotlib.image.imread(path)[..., :3]
    edges = [picture[:1], picture[-1:], picture[:, :1], picture[:, -1:]]
    return all(np.all(edge == 1.0) for edge in edges)


def texts_of(path: Path) -> list[str]:
    """The texts in an SVG, which are texts there and no outlines."""
    return [str(element.text) for element in ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")]
