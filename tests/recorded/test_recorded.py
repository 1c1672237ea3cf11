"""Eight small runs whose results were recorded once, with every setting spelled out: they must not change.

Each folder holds settings.yaml, history.csv (without wall_seconds), robustness.csv, and outputs.csv: what the champion
puts out, step after step, for rows of standard normal inputs. They repeat on processors of one class.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import yaml

from exneat_cli.brains.brain import activate, lay_out, memory_size
from exneat_cli.records import provenance
from exneat_cli.records.champion import read_champion
from exneat_cli.rollouts import Sweep
from exneat_cli.runs import RunSettings, run_robustness, train
from tests.records.histories import history_of

HERE = Path(__file__).parent
PROCESSOR = "AMD EPYC"
"""What they were recorded on; other processors round some functions of the mathematics library otherwise."""
STEPS = 12

RUNS = sorted(path.parent.name for path in HERE.glob("*/settings.yaml"))


def outputs_of(champion_file: Path) -> list[list[str]]:
    champion = read_champion(champion_file)
    brains = lay_out([champion.brain()])
    memory, action = np.zeros(memory_size(brains)), np.zeros(champion.plan.action_size)
    given = np.random.default_rng(1).standard_normal((STEPS, champion.plan.observation_size))
    outputs = []
    for row in given:
        memory[: len(row)] = row
        activate(brains, 0, memory, action)
        outputs.append([repr(value) for value in action.tolist()])
    return outputs


@pytest.mark.skipif(not provenance.processor().startswith(PROCESSOR), reason=f"recorded on {PROCESSOR}")
@pytest.mark.parametrize("name", RUNS)
def test_a_recorded_run_gives_the_same_bytes_again(tmp_path: Path, name: str) -> None:
    recorded = yaml.safe_load((HERE / name / "settings.yaml").read_text(encoding="utf-8"))
    settings = RunSettings.from_plain({**recorded["settings"], "output": str(tmp_path)})
    directory = train(settings).directory
    sweeps = [Sweep(**sweep) for sweep in recorded["sweeps"]]
    run_robustness(directory, sweeps, episodes=recorded["sweep_episodes"], executor=settings.executor)
    history = history_of(directory.history)
    assert history == history_of(HERE / name / "history.csv")
    assert list(history[0]) == list(history_of(HERE / name / "history.csv")[0])
    assert directory.robustness.read_bytes() == (HERE / name / "robustness.csv").read_bytes()
    with (HERE / name / "outputs.csv").open(encoding="utf-8") as file:
        assert outputs_of(directory.champion) == list(csv.reader(file))
