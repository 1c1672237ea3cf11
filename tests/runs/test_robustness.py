"""Robustness of finished runs, from Python: what was tested already is not tested again."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from exneat_cli.errors import ExneatError
from exneat_cli.records import read_robustness
from exneat_cli.records.champion import read_champion
from exneat_cli.rollouts import Executor, Noise, Outcomes, Runner, Sweep
from exneat_cli.runs import RunSettings, is_finished, robustness, run_robustness, train
from exneat_cli.runs.robustness import missing_levels
from exneat_cli.runs.scores import Score, score_all
from exneat_cli.seeding import shared_episodes
from exneat_cli.tasks import Hunting

SERIAL = Executor("serial")


def a_run(output: Path) -> RunSettings:
    return RunSettings(
        task=Hunting(p_m=0.3),
        noise=Noise(0.02),
        generations=1,
        population=4,
        episodes=1,
        validation_episodes=1,
        test_episodes=1,
        output=str(output),
    )


def test_each_level_holds_what_the_champion_gets_in_the_test_episodes(tmp_path: Path) -> None:
    settings = a_run(tmp_path)
    directory = train(settings).directory
    sweep = Sweep("p_m", "task.p_m", (0.0, 1.0))
    assert run_robustness(directory, [sweep], episodes=4, executor=SERIAL) == 2
    brain = read_champion(directory.champion).brain()
    for row in read_robustness(directory.robustness):
        with Runner(Hunting(p_m=row.level), Noise(0.02), SERIAL, training=False) as runner:
            fitness = runner.run([brain], shared_episodes("test", 4)).fitness
        assert row.fitness_mean == fitness.mean()
        assert row.fitness_std == fitness.std()


def test_only_what_is_missing_is_tested_and_workers_do_not_matter(tmp_path: Path) -> None:
    settings = a_run(tmp_path)
    directory = train(settings).directory
    two, three = (Sweep("p_e", "task.p_e", levels) for levels in ((0.0, 0.5), (0.0, 0.5, 1.0)))
    assert not is_finished(settings, [two], 4)
    assert run_robustness(directory, [two], episodes=4, executor=SERIAL) == 2
    assert is_finished(settings, [two], 4)
    assert missing_levels(directory, three, 4) == (1.0,)
    assert run_robustness(directory, [three], episodes=4, executor=Executor("threads", 3)) == 1
    grown = directory.robustness.read_bytes()
    directory.robustness.unlink()
    assert run_robustness(directory, [three], episodes=4, executor=SERIAL) == 3
    assert directory.robustness.read_bytes() == grown


def test_a_run_that_another_process_holds_is_refused(tmp_path: Path) -> None:
    directory = train(a_run(tmp_path)).directory
    sweep = Sweep("p_m", "task.p_m", (0.0,))
    with directory.held(), pytest.raises(ExneatError, match="another process is writing there"):
        run_robustness(directory, [sweep], episodes=2, executor=SERIAL)
    assert not directory.robustness.exists()


def test_failed_episodes_of_a_level_are_counted_once_though_its_rows_were_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    directory = train(a_run(tmp_path)).directory
    sweep = Sweep("p_m", "task.p_m", (0.0, 0.5))

    def failing(outcomes: Outcomes) -> list[Score]:
        return [replace(score, failed_episodes=2) for score in score_all(outcomes)]

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(robustness, "score_all", failing)
    with monkeypatch.context() as killed:
        killed.setattr(robustness, "merge_robustness", interrupted)
        with pytest.raises(KeyboardInterrupt):
            run_robustness(directory, [sweep], episodes=3, executor=SERIAL)
    assert run_robustness(directory, [sweep], episodes=3, executor=SERIAL) == 2
    assert directory.read_manifest().failed_robustness_episodes == {"p_m=0.0, 3 episodes": 2, "p_m=0.5, 3 episodes": 2}


def test_a_run_that_cannot_be_written_is_refused_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, content: bytes) -> None:
        raise ExneatError(f"{path}: could not be written: Permission denied")

    directory = train(a_run(tmp_path)).directory
    monkeypatch.setattr("exneat_cli.records.run_directory.write_whole", refuse)
    monkeypatch.setattr(robustness, "Runner", None)
    with pytest.raises(ExneatError, match="Permission denied"):
        run_robustness(directory, [Sweep("p_m", "task.p_m", (0.0,))], episodes=1, executor=SERIAL)
