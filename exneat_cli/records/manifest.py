"""manifest.json: how a run began, how it ended, and with what result."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from msgspec import Meta, Struct

from exneat_cli.records.plain import Count, Real, Word

MANIFEST_FORMAT = 3
RUNNING: Final = "running"
DONE: Final = "done"
FAILED: Final = "failed"
INTERRUPTED: Final = "interrupted"


class Score(Struct, frozen=True, forbid_unknown_fields=True):
    """Means and standard deviations (population, over episodes) of one brain.

    Attributes:
        episodes: how many were run.
        fitness_mean, fitness_std: of the task's fitness.
        full_reward_mean, full_reward_std: of the task's second figure.
        failed_episodes: how many failed; those count with the failure floor.
        fitness: of each episode, in the order of the shared episodes.
    """

    episodes: Annotated[int, Meta(ge=1)]
    fitness_mean: Real
    fitness_std: Real
    full_reward_mean: Real
    full_reward_std: Real
    failed_episodes: Count
    fitness: tuple[Real, ...]


class Result(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """What came of a run; a baseline has test figures alone.

    Attributes:
        training: best fitness of all generations.
        validation: mean fitness of the champion on the validation episodes.
        champion: on the test episodes; of a baseline, the baseline itself.
        standing_still: an agent that does nothing, on the same episodes.
        first_generation: the best team of the first generation, likewise.
    """

    training: Real | None = None
    validation: Real | None = None
    champion: Score
    standing_still: Score
    first_generation: Score | None = None


class Manifest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """What manifest.json holds.

    Attributes:
        format: of the run directory.
        status: `RUNNING`, `DONE`, `FAILED` or `INTERRUPTED`; a killed process leaves the first.
        process: id of the one that writes it.
        variant, task, seed: what is trained.
        configuration_hash: of all settings that results depend on, but for the generations.
        generations: how long it is trained; 0 for a baseline.
        command: the command line.
        started, finished: times (UTC); `resumed` are those at which the run went on.
        seeds: the root of its random streams, and their names.
        versions: of exneat, Python and libraries.
        processor, cores, git_commit: of the machine and the checkout, as far as they are known.
        budget_spent: training episodes, control steps and seconds.
        failed_robustness_episodes: how many failed, by level; none where nothing did.
        result: of a finished run.
        error: why it failed.
    """

    format: int
    status: Literal["running", "done", "failed", "interrupted"]
    process: Count = 0
    variant: Word
    task: Word
    seed: Count
    configuration_hash: Word
    generations: Count
    command: tuple[str, ...] = ()
    started: Word | None = None
    resumed: tuple[Word, ...] = ()
    finished: Word | None = None
    seeds: dict[str, Any] = {}
    versions: dict[str, str] = {}
    processor: str = ""
    cores: Count | None = None
    git_commit: str | None = None
    budget_spent: dict[str, int | Real] = {}
    failed_robustness_episodes: dict[str, Count] = {}
    result: Result | None = None
    error: str | None = None
