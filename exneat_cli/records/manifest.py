"""manifest.json: how a run began and ended, and with what result; docs/run-directory.md says what each field holds."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from msgspec import Meta, Struct

from exneat_cli.records.plain import Count, Real, Word

MANIFEST_FORMAT = 4
OLDER_FORMAT = 3
"""Can be read too, except for the tasks in `CHANGED_WORLDS`."""
CHANGED_WORLDS = ("foraging", "hunting")
"""Tasks in which the same settings meant something else before format 4: p_c was decay, not persistence."""
RUNNING: Final = "running"
DONE: Final = "done"
FAILED: Final = "failed"
INTERRUPTED: Final = "interrupted"


class Score(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Means and standard deviations (population, over episodes) of one brain, and its fitness in each of them.

    `steps_mean` is the mean number of control steps; runs of earlier versions do not have it.
    """

    episodes: Annotated[int, Meta(ge=1)]
    fitness_mean: Real
    fitness_std: Real
    full_reward_mean: Real
    full_reward_std: Real
    failed_episodes: Count
    fitness: tuple[Real, ...]
    steps_mean: Real | None = None


class Result(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """The results of a run; a baseline has only test figures.

    Attributes:
        training: best fitness of all generations.
        validation: mean fitness of the champion on the validation episodes.
        champion: on the test episodes; of a baseline, the baseline itself.
        standing_still, first_generation: likewise, of an agent that does nothing, and of the best random team.
    """

    training: Real | None = None
    validation: Real | None = None
    champion: Score
    standing_still: Score
    first_generation: Score | None = None


class Manifest(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """What manifest.json holds.

    A killed process leaves the status `RUNNING`. A baseline is trained for 0 generations. Times are in UTC;
    `resumed` holds those at which the run was resumed. There is a `result` if the run is done.
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
