"""Overrides and flags as strangers type them, beyond wrong values: grammar, deletions, groups, Hydra's own keys."""

from __future__ import annotations

from pathlib import Path

import pytest

from exneat_cli.main import main
from tests.commands.refusals import check_refusal

CASES = {
    "++sed=3": ["sed: unknown key", "did you mean seed?"],
    "+wiring.foo=1": ["wiring.foo: unknown key"],
    "~seed": ["~seed", "cannot be deleted"],
    "~task.max_steps": ["~task.max_steps", "cannot be deleted"],
    "~noise": ["~noise", "cannot be deleted"],
    "~nothing": ["~nothing", "cannot be deleted"],
    "seed.x=1": ["seed.x: unknown key"],
    "seed@x=1": ["seed@x=1"],
    "+task@x=ant": ["x: unknown key"],
    "=3": ["=3: expected key=value, got no key"],
    "===": ["===: expected key=value"],
    "+": ["+: expected key=value"],
    "~": ["~: expected key=value"],
    "seed==3": ["seed==3: expected key=value"],
    "seed:3": ["seed:3: expected key=value"],
    "seed=(1": ["seed=(1: expected key=value"],
    "seed='1": ["seed='1: expected key=value", "quotes"],
    'seed="1': ['seed="1: expected key=value', "quotes"],
    "name=a}": ["name=a}: expected key=value"],
    "name={a": ["name={a: expected key=value"],
    "name=${a": ["name=${a: expected key=value"],
    "name=ä": ["name=ä: expected key=value", "quotes"],
    "name='a\nb'": ["name=", "without control characters"],
    "name='\x1b[31m'": ["name=", "without control characters"],
    "output='a\x00b'": ["output=", "without control characters"],
    "output=out\udcff": ["output=", "without control characters"],
    "seed=" + "[" * 3000 + "]" * 3000: ["seed=[[["],
    "seed=int(a)": ["seed=int(a): expected key=value"],
    "seed=nope(1)": ["seed=nope(1): expected key=value"],
    "seed=choice(1,2)": ["seed=choice(1,2)", "--multirun"],
    "name=${oc.env:EXNEAT_NO_SUCH_THING}": ["name: ", "EXNEAT_NO_SUCH_THING"],
    "name=${nope:1}": ["name: ", "nope"],
    "name=${name}": ["name: Recursive interpolation"],
    "name=${nowhere.at.all}": ["name: refers to nowhere.at.all"],
    "name=???": ["name", "Missing mandatory value"],
    "name=a b": ["name: expected one folder name", "'a b'"],
    "name=..": ["name: expected one folder name"],
    "output=": ["output: expected a directory"],
    "output=null": ["output: expected a directory"],
    "output=[a]": ["output: expected a directory", "['a']"],
    "task=": ["task=: no such option; known: ant"],
    "task=3": ["task: expected the name of an option, got 3"],
    "task=nan": ["task: expected the name of an option, got nan"],
    "task=[ant]": ["task: expected one option, got ['ant']"],
    "task=[ant,hunting]": ["task: expected one option"],
    "task=../task/ant": ["task: expected the name of an option", "--config-dir"],
    "task=/etc/passwd": ["task: expected the name of an option, got '/etc/passwd'"],
    "linkage=lines": ["linkage=lines: no such option; known: feedback"],
    "executor=mpi": ["executor=mpi: no such option; known: dask, serial, threads"],
    "sweep=3": ["sweep: expected the name of an option, got 3"],
    "sweep=[gap,wind]": ["sweep=wind: no such option"],
    "generations=1e999": ["generations: expected", "inf"],
    "generations=1e3": ["generations: expected a whole number", "1000.0"],
    "generations=" + "9" * 5000: ["generations="],
    "noise.sensor_std=" + "9" * 400: ["noise.sensor_std: expected", "999..."],
    "noise.sensor_std=true": ["noise.sensor_std: expected", "True"],
    "resume=1": ["resume: expected true or false, got 1"],
    "budgets=1": ["generations: "],
    "task={name: ant}": ["task: expected the name of an option"],
    "algorithm={a: 1}": ["algorithm: expected"],
    "hydra.nope=1": ["hydra.nope=1: unknown key"],
    "+hydra.x=1": ["+hydra.x=1: unknown key"],
    "hydra.run.dir=x": ["hydra.run.dir=x: exneat sets hydra.run itself"],
    "hydra.output_subdir=x": ["exneat sets hydra.output_subdir itself"],
    "hydra.job.chdir=true": ["exneat sets hydra.job.chdir itself"],
    "hydra/job_logging=default": ["exneat sets hydra.job_logging itself"],
    "hydra.searchpath=[nowhere]": ["--config-dir"],
    "+hydra.callbacks.x._target_=os.getcwd": ["exneat sets hydra.callbacks itself"],
    "hydra/launcher=nope": ["hydra/launcher=nope: no such option"],
    "hydra=1": ["hydra"],
}


@pytest.mark.parametrize("given", CASES, ids=lambda given: ascii(given)[:40])
def test_an_override_that_makes_no_sense_is_refused_by_name(
    given: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    check_refusal(["train", "budget=smoke", "output=out", given], CASES[given], tmp_path, capfd)


TOGETHER = [
    (["geometry=custom", "geometry.vector=[0,0,0,999999999999]"], ["geometry.vector: expected", "without gaps"]),
    (["geometry=custom", "geometry.vector=[true,0,0,0]"], ["geometry.vector: expected"]),
    (["seed=${generations}", "generations=${seed}"], ["Recursive interpolation"]),
    (["sweep=reset_noise", "sweep.levels=[" + "9" * 400 + "]"], ["sweep.levels: expected finite numbers"]),
    (["sweep=reset_noise", "sweep.levels=[true]"], ["sweep.levels: expected finite numbers", "True"]),
    (["sweep=reset_noise", "sweep.levels=[0,0]"], ["sweep.levels: expected levels that all differ"]),
    (["-m", "seed=range(0,1000000000)"], ["seed=range(0,1000000000)", "at most 10000 jobs"]),
    (["-m", "seed=range(0,200)", "population=range(2,200)"], ["population=range(2,200)", "at most 10000 jobs"]),
    (["-m", "seed=choice(1,"], ["seed=choice(1,: expected key=value"]),
    (["-m", "seed=0,1", "task=ant,nope"], ["task=nope: no such option"]),
    (["--config-name", "nope"], ["nope"]),
    (["--run", "--multirun"], ["--multirun"]),
    (["--config-dir", "nowhere"], ["nowhere: expected a directory", "got nothing"]),
    (["--config-path", "nowhere"], ["nowhere: expected a directory"]),
]


@pytest.mark.parametrize(("given", "named"), TOGETHER, ids=[" ".join(given)[:50] for given, _ in TOGETHER])
def test_arguments_that_make_no_sense_together_are_refused_by_name(
    given: list[str],
    named: list[str],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    check_refusal(["train", "budget=smoke", "output=out", *given], named, tmp_path, capfd)


def test_a_package_that_is_not_there_is_refused_although_hydra_speaks_first(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "--cfg", "job", "--package", "nope"]) == 2
    message = capfd.readouterr().err
    assert "package 'nope' not found" in message
    assert len(message.strip().splitlines()) == 2
