"""Tasks of users, named by task.kind or registered by a package, go the whole way; strangers' runs import nothing."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from exneat_cli.main import main
from exneat_cli.records import RunDirectory, read_robustness, read_yaml
from tests.commands.refusals import check_refusal
from tests.commands.user_modules import CORRIDOR, EXAMPLE, MARK, forget_user_code
from tests.records.histories import history_of

pytestmark = pytest.mark.usefixtures("no_figures")
CUSTOM = ["task=custom", "task.kind=walks:Corridor"]
SMALL = ["budget=smoke", "executor=serial"]
SWEEP = ["sweep=sensor_noise", "sweep.levels=[0,0.2]", "sweep.episodes=2"]
EXPERIMENT = """
claim: One network is enough.
settings: {task: custom, task.kind: "walks:Corridor"}
variants: {neat: {label: NEAT, settings: {algorithm: neat}}, all: {label: modules, settings: {geometry: all}}}
conditions: {clean: {label: no noise, settings: {}}}
runs: {smoke: 2}
"""


@pytest.fixture(autouse=True)
def _walks(workplace: Path) -> None:
    Path("walks.py").write_text(CORRIDOR + MARK, encoding="utf-8")


def runs_in(output: str) -> list[RunDirectory]:
    return [RunDirectory(path.parent) for path in sorted(Path(output).rglob("manifest.json"))]


def installed(folder: Path, *entry_points: str, package: str = "walking") -> None:
    """Put a package's metadata into a folder of `sys.path`, as pip does."""
    metadata = folder / f"{package}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("\n".join(["[exneat.tasks]", *entry_points, ""]))
    sys.path.append(str(folder))


def test_a_class_that_is_named_trains_resumes_to_the_same_bytes_and_is_evaluated() -> None:
    asked = ["train", *CUSTOM, *SMALL, "task.length=7", "evolution.conn_add_prob=0.3"]
    assert main([*asked, "output=whole", "generations=3"]) == 0
    assert main([*asked, "output=parts", "generations=2"]) == 0
    assert main([*asked, "output=parts", "generations=3", "resume=true"]) == 0
    (whole,), (parts,) = runs_in("whole"), runs_in("parts")
    assert history_of(whole.history) == history_of(parts.history)
    assert whole.champion.read_bytes() == parts.champion.read_bytes()
    plain = read_yaml(whole.config)
    assert plain["task"] == {"name": "corridor", "length": 7, "kind": "walks:Corridor"}
    assert plain["evolution"]["feed_forward"] is False, "the class says what suits it"
    assert plain["evolution"]["conn_add_prob"] == 0.3
    forget_user_code()
    assert main(["evaluate", f"run={whole.path}", *SWEEP, "task.kind=walks:Corridor"]) == 0
    assert len(whole.robustness.read_text(encoding="utf-8").splitlines()) == 3
    assert main(["inspect", f"run={whole.path}"]) == 0


def test_inspect_shows_the_parts_of_a_class_that_is_named(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", *CUSTOM]) == 0
    assert "task corridor: 2 sensors" in capfd.readouterr().out


def test_sensor_noise_has_levels_for_a_task_that_it_does_not_know() -> None:
    assert main(["train", *CUSTOM, *SMALL, "sweep=sensor_noise"]) == 0
    (run,) = runs_in("outputs")
    levels = [row.level for row in read_robustness(run.robustness) if row.parameter == "sensor_noise"]
    assert levels == [0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0]


def test_a_file_of_the_users_may_name_the_class_and_a_multirun_varies_it(capfd: pytest.CaptureFixture[str]) -> None:
    Path("mine/task").mkdir(parents=True)
    text = (EXAMPLE.parent / "conf/task/corridor.yaml").read_text(encoding="utf-8")
    Path("mine/task/walk.yaml").write_text(text.replace("name: corridor", "name: corridor\n  kind: walks:Corridor"))
    Path("others.py").write_text(CORRIDOR, encoding="utf-8")
    varied = "task.kind=walks:Corridor,others:Corridor,others:Corrido"
    assert main(["train", "-m", "--config-dir", "mine", "task=walk", *SMALL, varied]) == 2
    assert "others:Corrido" in capfd.readouterr().err
    runs = runs_in("outputs")
    assert len(runs) == 2, "the class is part of what a run is"
    assert history_of(runs[0].history) == history_of(runs[1].history)


def test_an_experiment_that_names_the_class_is_swept_and_reported() -> None:
    Path("walking.yaml").write_text(EXPERIMENT)
    common = ["experiment=walking.yaml", "budget=smoke"]
    assert main(["sweep", *common, "executor=serial"]) == 0
    forget_user_code()
    assert main(["sweep", *common, "executor=serial"]) == 0
    assert main(["report", *common]) == 0
    assert "modules" in Path("outputs/report/walking/index.html").read_text(encoding="utf-8")


def test_what_an_installed_package_registers_goes_by_its_name(tmp_path: Path) -> None:
    installed(tmp_path / "site", "corridor = walks:Corridor")
    shutil.move("walks.py", "site/walks.py")
    assert main(["train", "task=custom", "task.name=corridor", *SMALL]) == 0
    assert main(["train", "--config-dir", str(EXAMPLE.parent / "conf"), "task=corridor", *SMALL]) == 0
    runs = runs_in("outputs")
    assert all("kind" not in read_yaml(run.config)["task"] for run in runs)
    for run in runs:
        assert main(["evaluate", f"run={run.path}", *SWEEP]) == 0


def test_a_run_that_names_a_class_is_read_where_a_package_registers_it(tmp_path: Path) -> None:
    assert main(["train", *CUSTOM, *SMALL]) == 0
    forget_user_code()
    sys.path[:] = [place for place in sys.path if place != str(tmp_path)]
    installed(tmp_path / "site", "corridor = walks:Corridor")
    shutil.move("walks.py", "site/walks.py")
    (run,) = runs_in("outputs")
    assert main(["evaluate", f"run={run.path}", *SWEEP]) == 0


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        ("task.name=corridor", "task.name: expected the name of one task, got 'corridor'\n  packages define several"),
        ("task.name=corider", "task.name: expected one of ant, broken, corridor, foraging"),
        ("task.name=broken", "task.kind: expected a class that can be imported from here, got 'nowhere:Task'"),
        ("task.name=null", "task.name: expected one of"),
        ("task.kind=walks", "task.kind: expected module:name, e.g. task.kind=my_package.my_module:MyTask, got 'walks'"),
        ("task.kind=3", "task.kind: expected package.module:Class, got 3"),
        ("task.kind=walks:Corrido", "AttributeError: module 'walks' has no attribute 'Corrido'"),
        ("task.kind=wlaks:Corridor", "ModuleNotFoundError: No module named 'wlaks'"),
        ("task.kind=bad:Corridor", "SyntaxError"),
        ("task.kind=ends:Corridor", "SystemExit: 3"),
        ("task.kind=walks:step", "task.kind: expected a class that derives from exneat_cli.tasks.Task"),
        ("task.kind=exneat_cli.tasks:Task", "it lacks actuator_names, longest_episode, observation_size"),
        ("task.kind=kinds:Thawed", "task.kind: expected a frozen dataclass"),
        ("task.kind=kinds:Kind", "a dataclass with a field `name` and none called `kind`"),
        ("task.kind=walks:Corridor task.size=3", "task.size: unknown key (value 3)"),
        ("task.kind=walks:Corridor task.length=2", "task.length: expected a whole number from 3 to 99, got 2"),
        ("task.kind=kinds:Rash task.width=x", "task: expected parameters that Rash accepts"),
        (
            "task.kind=walks:Corridor task.name=hunting",
            "task.kind: expected nothing, for task.name=hunting has a class",
        ),
        ("task=ant task.kind=walks:Corridor", "choose task=custom, or a file of yours in --config-dir"),
    ],
)
def test_a_class_that_cannot_be_used_is_refused(
    setting: str, named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    Path("walks.py").write_text(CORRIDOR, encoding="utf-8")
    Path("bad.py").write_text("class Corridor(:\n")
    Path("ends.py").write_text("raise SystemExit(3)\n")
    Path("kinds.py").write_text(
        "from dataclasses import dataclass\nfrom exneat_cli.tasks import AntTask, Task\nfrom walks import Corridor\n"
        "class Thawed(Task):\n    parts = observation_size = actuator_names = longest_episode = open = None\n"
        "@dataclass(frozen=True)\nclass Kind(Corridor):\n    kind: str = ''\n"
        "@dataclass(frozen=True)\nclass Rash(Corridor):\n    width: int = 1\n"
        "    def __post_init__(self):\n        assert self.width > 0\n"
    )
    installed(tmp_path / "one", "corridor = walks:Corridor", "broken = nowhere:Task", package="one")
    installed(tmp_path / "two", "corridor = kinds:Corridor", package="two")
    task = [] if setting.startswith("task=") else ["task=custom"]
    check_refusal(["train", *task, *setting.split(), *SMALL], [named], tmp_path, capfd)


WORLDS = {
    "readings": ("observation_size: ClassVar[int] = 2", "observation_size: ClassVar[int] = 1", "parts[1].sensors"),
    "more readings": ("observation_size: ClassVar[int] = 2", "observation_size: ClassVar[int] = 3", "observe"),
    "nan": ("readings[:] = world.light[tile - 1],", "readings[:] = np.nan,", "nan in entry 0"),
}
"""What is wrong in a module, and what is said; tests/tasks/test_contract.py has more of them."""


@pytest.mark.parametrize(("name", "many"), [("readings", False), ("more readings", True), ("nan", False)])
def test_a_world_that_breaks_the_contract_leaves_nothing_behind_and_runs_once_it_is_right(
    name: str, many: bool, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    old, new, named = WORLDS[name]
    Path("walks.py").write_text(CORRIDOR.replace(old, new), encoding="utf-8")
    Path("walking.yaml").write_text(EXPERIMENT)
    command = ["sweep", "experiment=walking.yaml"] if many else ["train", *CUSTOM]
    check_refusal([*command, *SMALL], [named], tmp_path, capfd)
    Path("walks.py").write_text(CORRIDOR, encoding="utf-8")
    forget_user_code()
    assert main([*command, *SMALL]) == 0


@pytest.fixture
def strangers_run() -> RunDirectory:
    """A finished run that names a class that would tell of its import."""
    assert main(["train", *CUSTOM, *SMALL]) == 0
    forget_user_code()
    Path("imported").unlink()
    (run,) = runs_in("outputs")
    return run


def test_code_is_not_imported_because_a_run_names_it(
    strangers_run: RunDirectory, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = strangers_run.path
    named = ["task.kind", "'walks:Corridor'", "task.kind=walks:Corridor"]
    check_refusal(["evaluate", f"run={run}", *SWEEP], named, tmp_path, capfd)
    check_refusal(["evaluate", "run=outputs/*/*", *SWEEP, "task.kind=other:Class"], named, tmp_path, capfd)
    again = ["train", "--config-path", str(run)]
    for asked in (again, [*again, "resume=true"], [*again, "output=new"], [*again, "task.length=7"]):
        check_refusal(asked, named, tmp_path, capfd)
    assert main([*again, "-m", "seed=0,1"]) == 2
    assert main(["inspect"]) == main(["inspect", f"run={run}"]) == 0
    assert main([*again, "--cfg", "job"]) == 0
    assert not Path("imported").exists()
    assert main([*again, "task.kind=walks:Corridor"]) == 0
    assert "finished already" in capfd.readouterr().out


def test_a_run_in_the_place_of_ones_own_imports_nothing_in_sweep_and_report(capfd: pytest.CaptureFixture[str]) -> None:
    text = EXPERIMENT.replace('task: custom, task.kind: "walks:Corridor"', "task: track_maze")
    text = text.replace("label: no noise, settings: {}", "label: no noise, settings: {}, sweeps: [gap]")
    Path("mazes.yaml").write_text(text)
    asked = ["experiment=mazes.yaml", *SMALL, "sweep.levels=[1]", "sweep.episodes=1"]
    assert main(["sweep", *asked]) == 0
    for run in runs_in("outputs"):
        run.config.write_text(
            run.config.read_text().replace("name: track_maze", "name: track_maze\n  kind: walks:Corridor")
        )
        run.robustness.unlink()
    assert main(["sweep", *asked]) == 1
    assert "task.kind" in capfd.readouterr().err
    assert main(["report", *asked]) == 0
    assert not Path("imported").exists()


JOBLIB = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2", "executor=serial"]
SUBMITIT = ["hydra/launcher=submitit_local", "hydra.sweep.dir=jobs", "executor=serial"]
DASK = ["executor=dask", "executor.workers=1"]


@pytest.mark.parametrize(
    ("is_program", "workers"),
    [(True, JOBLIB), (False, SUBMITIT), (False, DASK)],
    ids=["program-joblib", "kind-submitit", "kind-dask"],
)
def test_workers_know_what_a_user_named_or_a_program_registered(is_program: bool, workers: list[str]) -> None:
    for library in ("hydra_plugins.hydra_joblib_launcher", "hydra_plugins.hydra_submitit_launcher", "distributed"):
        pytest.importorskip(library)
    named = [str(Path(sys.executable).parent / "exneat"), "train", *CUSTOM]
    program = [sys.executable, str(EXAMPLE), "train", "task=custom", "task.name=corridor"]
    asked = [*(program if is_program else named), "-m", "budget=smoke", "seed=0,1", *SWEEP, *workers]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert [len(run.robustness.read_text().splitlines()) for run in runs_in("outputs")] == [3, 3]
