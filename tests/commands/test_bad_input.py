"""What users get wrong on the command line: at most three lines, exit code 2, no traceback, nothing half-made."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from exneat_cli.commands.command_line import read_command_line
from exneat_cli.commands.jobs import read_job
from exneat_cli.commands.sweep import results_file
from exneat_cli.errors import ConfigError, check_path
from exneat_cli.main import main
from exneat_cli.runs import RunSettings
from exneat_cli.tasks.robots.models import path_of
from tests.commands.refusals import TASK, check_message, check_refusal

pytestmark = pytest.mark.usefixtures("no_figures")
TRAIN = {
    # what is given besides budget=smoke output=out, and what the message must name
    "sed=3": "sed: unknown key (value 3)\n  did you mean seed?",
    "tsk=ant": "did you mean task?",
    "algorithm=exnet": "did you mean exneat?",
    "pairing=rnk": "did you mean rank?",
    "+sed=3": "did you mean seed?",
    "++sed=3": "did you mean seed?",
    "buget=paper": "did you mean budget?",
    "+task.foo=1": "task.foo: unknown key",
    "task.max_step=5": "did you mean task.max_steps?",
    "+wiring.foo=1": "wiring.foo: unknown key",
    "+evolution.elitsm=1": "did you mean evolution.elitism?",
    "algorithm.kept=1": "algorithm.kept: unknown key",
    "executor=serial executor.workers=2": "executor.workers: expected a whole number from 0 to 1, got 2",
    "seed=-1": "seed: expected a whole number from 0 to 18446744073709551615, got -1",
    "seed=abc": "seed: expected a whole number",
    "seed=null": "seed: expected",
    "seed=": "seed: expected",
    "seed==3": "seed: expected a whole number from 0 to 18446744073709551615, got '=3'",
    "seed.x=1": "seed: expected",
    "seed=1,2": "seed=1,2: expected one value, got several\n  exneat train -m (--multirun) runs each of them",
    "'seed=choice(1,2)'": "expected one value, got several",
    "seed=99999999999999999999999999999999999999": "seed: expected",
    "generations=0": "generations: expected a whole number of at least 1, got 0",
    "generations=1e3": "generations: expected a whole number of at least 1, got 1000.0",
    "judging=first": "judging: expected one of last, mean",
    "champion=lucky": "champion: expected one of race, thesis",
    "recipe=running": "recipe=running: no such option; known: thesis, walking",
    "task=hunting recipe=thesis": "recipe: expected nothing, since this command, or the chosen task,",
    "linkage=hidden": "recipe=thesis has hidden nodes",
    "linkage=feedback wiring.central=false": "wiring.central=true",
    "linkage=hidden evolution.module_hidden=0": "evolution.module_hidden",
    "wiring.central=true": "recipe=thesis has hidden nodes and a central module",
    "evolution.weight_mutate_power=0": "evolution.weight_mutate_power: expected 0 < weight_mutate_power_min <=",
    "evolution.weight_mutate_power=nan": "evolution.weight_mutate_power: expected a number",
    "evolution.weight_mutate_power_max=0.001": "evolution.weight_mutate_power: expected 0 < weight_mutate_power_min",
    "evolution.genome=stock": "evolution.mutation: expected fixed with genome=stock, got 'adaptive'",
    "recipe=thesis evolution.genome=stock evolution.crossover_prob=0.5": "evolution.crossover_prob: expected 1.0 with",
    "resume=1": "resume: expected true or false, got 1",
    "noise.sensor_std=nan": "noise.sensor_std: expected",
    "noise.reset_scale=[1]": "noise.reset_scale: expected",
    "task.patience=99999999999999999999": "task.patience: expected",
    "task.reward=full": "task.reward: expected one of thesis, gymnasium, got 'full'",
    "+budgets.quik.generations=3": "budgets.quik: expected one of paper, quick, smoke",
    "+budgets.smoke.generation=3": "did you mean budgets.smoke.generations?",
    "budgets=1": "generations: ",
    "wiring=3": "wiring: expected a section",
    "wiring.central=maybe": "wiring.central: expected true or false",
    "wiring.central=false wiring.output_width=3": "wiring.output_width: expected",
    "name=../../x": "name: expected one folder name",
    "name=": "name: expected one folder name",
    "'name=a b'": "name: expected one folder name of letters, digits, '.', '_' and '-', got 'a b'",
    "name=a}": "got 'a}'",
    "name=ä": "got 'ä'",
    "name=[a]": "got '[a]'",
    "'name=${a'": "name='${a'",
    "'name=${nope:1}'": "name: Unsupported interpolation type nope",
    "'name=${name}'": "name: Recursive interpolation",
    "'name=${nowhere.at.all}'": "name: Interpolation key 'nowhere.at.all' not found",
    "'name=${oc.env:EXNEAT_NO_SUCH_THING}'": "EXNEAT_NO_SUCH_THING",
    "'seed=${generations}' 'generations=${seed}'": "Recursive interpolation",
    "name=???": "name: Missing mandatory value",
    "output=": "output: expected a directory",
    "output=null": "output: expected a directory",
    "task=atn": "task=atn: no such option; known: ant, custom, foraging, general_maze, gym, hunting, robot, track_maze",
    "task=": "task=: no such option; known: ant",
    "task=null": "task: expected the name of an option, got None",
    "task=3": "task: expected the name of an option, got 3",
    "'task={name: ant}'": "task: expected the name of an option",
    "task=[ant,hunting]": "task: expected one option, got ['ant', 'hunting']\n  exneat train -m task=",
    "geometry=triangle": "geometry=triangle: no such option; known: all, auto, cross, custom, fb, lr, single",
    "linkage=lines": "linkage=lines: no such option; known: feedback",
    "executor=mpi": "executor=mpi: no such option; known: dask, processes, serial, threads",
    "sweep=3": "sweep: expected the name of an option, got 3",
    "sweep=[gap,wind]": "sweep=wind: no such option; known: gap",
    "~seed": "~seed: a setting cannot be deleted",
    "~task": "~task: a setting cannot be deleted",
    "geometry=custom": "geometry.vector: expected",
    "geometry=custom geometry.vector=[0,0": "geometry.vector: expected",
    "algorithm=linear_fusion": "only grid worlds have it",
    "algorithm=ars evolution.initial_connection=unconnected": "evolution.initial_connection: expected full_direct or",
    "algorithm=ars evolution.bias_init_stdev=0 evolution.bias_mutate_rate=0 algorithm.normalise=true": "without biases",
    "task=foraging algorithm=ars algorithm.normalise=true": "algorithm.normalise: expected false for networks without",
    "algorithm=ars population=7": "population: expected an even number, got 7",
    "algorithm=cma_es population=3": "population: expected at least 4",
    "algorithm=ars population=10 algorithm.top=6": "algorithm.top: expected at most 5, or null, got 6",
    "algorithm=ars algorithm.top=0": "algorithm.top: expected a whole number of at least 1",
    "algorithm=ars algorithm.step_size=0": "algorithm.step_size: expected a number of at least 1e-06, got 0",
    "algorithm=ars algorithm.noise=nan": "algorithm.noise: expected",
    "algorithm=openai_es algorithm.step_size=.inf": "algorithm.step_size: expected",
    "algorithm=openai_es algorithm.weight_decay=-1": "algorithm.weight_decay: expected",
    "algorithm=cma_es algorithm.sigma=0": "algorithm.sigma: expected",
    "algorithm=cma_es algorithm.covariance=full geometry=all evolution.module_hidden=4": "weights and biases: use",
    "algorithm=cma_es algorithm.covariance=block": "algorithm.covariance: expected one of full, separable",
    "algorithm=ars judging=mean": "judging: expected last, got 'mean'",
    "algorithm=ars algorithm.modular=false geometry=all": "algorithm=ars algorithm.modular=false has no part modules",
    "algorithm=ars algorithm.modular=3": "algorithm.modular: expected true or false",
    "algorithm=ars pairing=index": "pairing: expected rank, its default",
    "task=track_maze task.size=12": "task.size: expected an odd number",
    "task=track_maze task.patience=3": "task.patience: unknown key",
    "task=track_maze wiring.central=true": "task=track_maze has no trunk",
    "task=foraging linkage=full": "linkage: expected none or output with task=foraging and its other settings",
    "task=ant linkage=full": "linkage: expected none or output or joints with task=ant",
    "task=track_maze linkage=feedback": "has no trunk for one",
    "task=gym executor.workers=-1": "executor.workers: expected a whole number",
    "sweep=gap": "sweep: expected a sweep that fits task=ant, got 'gap'",
    "seed": "seed: expected key=value",
    "seed:3": "seed:3: expected key=value",
    "=3": "=3: expected key=value, got no key",
    "===": "===: expected key=value",
    "+": "+: expected key=value",
    "hydra.run.dir=x": "hydra.run.dir=x: exneat sets hydra.run.dir itself\n  you may set hydra/launcher=",
    "hydra.output_subdir=x": "exneat sets hydra.output_subdir itself",
    "hydra.job.chdir=true": "exneat sets hydra.job.chdir itself",
    "hydra/job_logging=default": "exneat sets hydra.job_logging itself",
    "hydra.searchpath=[nowhere]": "exneat sets hydra.searchpath itself",
    "+hydra.callbacks.x._target_=os.getcwd": "exneat sets hydra.callbacks.x._target_ itself",
    "hydra=1": "hydra",
    "hydra/launcher=nope": "hydra/launcher=nope: no such option; known: basic",
    "hydra/launcher=joblib hydra.launcher.njobs=2": "hydra.launcher.njobs: unknown key; known here: _target_, n_jobs",
    "hydra/launcher=joblib +hydra.launcher.x._target_=os.getcwd": "a configuration may not call code",
    "--bogus": "--bogus: unknown flag; settings are written key=value",
    "--multrun": "--multrun: unknown flag; did you mean --multirun?",
    "--config-dir": "--config-dir: expected one argument",
    "--config-dir nowhere": "nowhere: expected a directory with YAML files, got nothing",
    "--config-path nowhere": "nowhere: expected a directory with YAML files, got nothing",
    "--config-dir a_file": "a_file: expected a directory with YAML files, got a file",
    "--config-name nope": "--config-name=nope: no such option; known: config",
    "--cfg everything": "--cfg: invalid choice: 'everything'",
}
OTHERS = {
    "fly": "fly: expected a command, one of train",
    "trian": "did you mean train?",
    "'\x1b[31mfly'": "fly: expected a command",
    "inspect run=nowhere": "run=nowhere: there is no such run",
    "inspect run=": "run: expected a run directory",
    "inspect outptu=x": "did you mean output?",
    "doctor output=": "output: expected a directory",
    "doctor run=outputs": "run: unknown key (value 'outputs')\n  known here: output",
    "doctor -m": "-m: only exneat train accepts several values",
    "evaluate sweep=gap": "run: expected a run directory",
    "evaluate run=nowhere sweep=gap": "run=nowhere: there is no such run",
    "evaluate run=a_file sweep=gap": "run=a_file: there is no such run",
    "evaluate run=x sweep=sensor_nose": "did you mean sensor_noise?",
    "evaluate run=no*thing sweep=gap": "run: expected a run directory, or a pattern",
    "evaluate run=[a sweep=gap": "run: expected a run directory, or a pattern that matches some, got '[a'",
    "evaluate --what sweep=gap": "--what: unknown flag",
    "report": "output=outputs: no finished run of ant",
    "report budget=huge": "budget=huge: no such option; known: paper, quick, smoke",
    "report only=figure-9.9": "only: expected one of figure-4.1",
    "report only=figure-4.33": "did you mean figure-4.3?",
    "report only=figure-4.1": "no finished run of track_maze\n  exneat sweep experiment=track_maze budget=quick",
    "report onyl=figure-4.1": "did you mean only?",
    "report axis=time": "axis: expected one of generation, episodes, env_steps",
    "report experiment=chess": "experiment: expected one of ant",
    "report experiment=nowhere.yaml": "nowhere.yaml: could not be read: No such file",
    "search": "space: expected one of mutation, or a .yaml file",
    "search space=chess": "space: expected one of mutation, or a .yaml file, got 'chess'",
    "search space=mutation trials=0": "trials: expected a whole number of at least 1, got 0",
    "search space=nowhere.yaml": "nowhere.yaml: could not be read",
    "search space=mutation sed=3": "did you mean seed?",
    "report columns=3": "columns: expected 1 or 2, or null",
    "report style=nowhere.mplstyle": "style=nowhere.mplstyle: the style sheet cannot be read",
    "train tracker=tensorbord": "did you mean tensorboard?",
    "sweep": "experiment: expected a name or a YAML file",
    "sweep experimnt=ant": "did you mean experiment?",
    "sweep experiment=ant budget=": "budget=: no such option",
    "sweep experiment=ant seed=0,1": "seed=0,1: expected one value, got several",
    "sweep experiment=ant noise=5": "noise: expected the name of an option, got 5",
    "sweep experiment=ant sed=3": "did you mean seed?",
    "sweep experiment=ant generations=0": "ant, walk, neat: generations: expected",
}
CASES = [
    *((["train", "budget=smoke", "output=out", *shlex.split(given)], named) for given, named in TRAIN.items()),
    *((shlex.split(given), named) for given, named in OTHERS.items()),
]


@pytest.mark.parametrize(("arguments", "named"), CASES, ids=[ascii(given) for given in (*TRAIN, *OTHERS)])
def test_a_command_line_that_makes_no_sense_is_refused_before_anything_is_made(
    arguments: list[str], named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_file").touch()
    check_refusal(arguments, [named], tmp_path, capfd)


def test_an_output_that_cannot_be_made_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to("nowhere")
    long = "x" * 300
    train = ["train", "budget=smoke"]
    check_refusal([*train, "output=file"], ["the directory cannot be made"], tmp_path, capfd)
    dangling = "link: expected a directory, got a link that leads nowhere, to nowhere"
    check_refusal([*train, "output=link"], [f"exneat: {dangling}"], tmp_path, capfd)
    check_refusal([*train, f"output={long}"], ["File name too long"], tmp_path, capfd)
    check_refusal(["inspect", f"run={long}"], ["there is no such run"], tmp_path, capfd)
    if os.getuid() == 0:
        check_refusal([*train, "output=/proc/exneat"], ["/proc/exneat"], tmp_path, capfd)
    else:
        tmp_path.chmod(0o500)
        check_refusal([*train, "output=out"], ["Permission denied"], tmp_path, capfd)


@pytest.mark.parametrize("command", ["train", "inspect", "doctor"])
def test_a_working_directory_that_is_gone_is_named(
    command: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    check_refusal([command], ["the current directory cannot be used: No such file"], tmp_path, capfd)
    monkeypatch.chdir(tmp_path)


def test_a_directory_that_holds_something_else_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    command = ["train", "budget=smoke", f"output={tmp_path}", "algorithm=random"]
    assert main(command) == 0
    (run,) = (tmp_path / "ant").iterdir()
    (run / "manifest.json").unlink()
    check_refusal(command, ["manifest.json"], tmp_path, capfd)
    (run / "manifest.json").write_text("{")
    check_refusal(command, ["manifest.json"], tmp_path, capfd)


def test_a_bad_job_of_a_multirun_leaves_the_others_alone(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    code = main(["train", "-m", "budget=smoke", f"output={tmp_path}", "algorithm=random", "seed=0,-1,2"])
    error = capfd.readouterr().err
    assert code == 2
    assert "exneat: seed=-1: seed: expected a whole number" in error
    assert "Traceback" not in error
    assert sorted(path.name.rsplit("-", 1)[0] for path in (tmp_path / "ant").iterdir()) == ["random-s0", "random-s2"]
    assert [path.name for path in tmp_path.iterdir()] == ["ant"]


@pytest.mark.parametrize(
    ("output", "place"),
    [
        *(("runs [1] (é)", "runs [1] (é)"), ("it's", "it's"), ("[a]", "[a]"), ("'3'", "3"), ("1e5", "1e5")),
        *(("~/x", "home/x"), ("'~/x'", "home/x")),
    ],
)
def test_a_value_means_the_same_in_every_command_whatever_its_characters(
    output: str,
    place: str,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLCONFIGDIR", str(tmp_path_factory.mktemp("fonts")))  # whoever imports matplotlib first
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert main(["train", "task=track_maze", "algorithm=motionless", "budget=smoke", f"output={output}"]) == 0
    (run,) = (tmp_path / place / "track_maze").iterdir()
    assert main(["inspect", f"output={output}"]) == 0
    assert run.name in capfd.readouterr().out
    quote = "'" * output.endswith("'")
    evaluate = ["evaluate", "sweep=gap", "sweep.levels=[1]", "sweep.episodes=1"]
    for fitting in (run.name, "*"):
        assert main([*evaluate, f"run={output.removesuffix(quote)}/track_maze/{fitting}{quote}"]) == 0
    assert "robustness.csv: 1 levels tested" in capfd.readouterr().out
    check_refusal(["report", f"output={output}"], [place, "no finished run of ant"], tmp_path, capfd)


def test_the_installed_program_refuses_in_the_same_words(tmp_path: Path) -> None:
    program = [str(Path(sys.executable).parent / "exneat"), "train", "seed=x", "output=out"]
    done = subprocess.run(program, capture_output=True, text=True, check=False, cwd=tmp_path)
    check_message(done.returncode, done.stderr, "seed: expected")
    assert not done.stdout
    assert not list(tmp_path.iterdir())


def test_what_is_typed_for_a_name_stays_as_it_was_also_in_a_multirun_and_in_the_runs_own_file(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    train = ["train", "task=track_maze", "algorithm=motionless", "budget=smoke"]
    assert main([*train, "-m", "name=2026_11_26,1e5"]) == 0
    assert {path.name for path in Path("outputs").iterdir()} == {"2026_11_26", "1e5"}
    (run,) = Path("outputs/1e5").iterdir()
    assert main(["train", "--config-path", str(run)]) == 0
    assert "finished already" in capfd.readouterr().out


def test_a_path_in_a_file_of_ones_own_begins_at_home_where_a_tilde_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "task").mkdir()
    (tmp_path / "task" / "own.yaml").write_bytes(TASK + b"output: ~/runs\n")
    line = read_command_line("train", ["--config-dir", str(tmp_path), "task=own", "budget=smoke"])
    settings = read_job("", line).settings
    assert settings.directory.path.is_relative_to(tmp_path / "home" / "runs")
    for make in (lambda path: RunSettings(output=path).output, lambda path: check_path("run", path)):
        assert Path(make("~/x")) == tmp_path / "home" / "x"
    with pytest.raises(ConfigError, match=r"got '~/no\.xml'"):
        path_of("~/no.xml")
    assert results_file("~/mine.yaml") == tmp_path / "home" / "results" / "mine.csv"
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "yes.xml").touch()
    assert path_of("~/yes.xml").exists()
