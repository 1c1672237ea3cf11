"""Robots from the command line: a model file of one's own, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from exneat_cli.main import main
from exneat_cli.records import read_robustness
from exneat_cli.records.champion import read_champion
from tests.commands.refusals import check_refusal

pytestmark = pytest.mark.usefixtures("no_figures")
LEG = """
      <body name="{name}" pos="{x} {y} 0"><joint name="{name}_hip" axis="0 1 0" range="-40 40"/>
        <geom type="capsule" size="0.04" fromto="0 0 0 0 0 -0.3"/></body>"""
ROBOT = """<mujoco><compiler angle="degree" autolimits="true"/><option timestep="0.01"/>
  <worldbody><geom type="plane" size="10 10 1"/>
    <body name="trunk" pos="0 0 0.35">{root}<geom type="box" size="0.3 0.15 0.05"/>{legs}
    </body></worldbody>
  <actuator>{motors}</actuator></mujoco>"""
LEGS = {"fl": (0.3, 0.15), "fr": (0.3, -0.15), "bl": (-0.3, 0.15), "br": (-0.3, -0.15)}
MOTORS = "".join(f'<motor joint="{name}_hip" ctrlrange="-1 1" gear="5"/>' for name in LEGS)
SOUND = ROBOT.format(
    root="<freejoint/>", legs="".join(LEG.format(name=n, x=x, y=y) for n, (x, y) in LEGS.items()), motors=MOTORS
)
COMMON = ["task=robot", "budget=smoke", "executor=serial", "population=4", "task.max_steps=40"]


def write(path: Path, text: str = SOUND) -> str:
    path.write_text(text)
    return f"task.model={path}"


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (None, "expected an MJCF file that exists, got 'robot.xml'"),
        ("not XML", "expected an MJCF file, got"),
        (SOUND.replace(MOTORS, ""), "expected a model with actuators"),
        (SOUND.replace("<freejoint/>", ""), "expected a body that moves freely or in a plane"),
        (SOUND.replace('type="box"', 'type="no"'), "expected an MJCF file that MuJoCo can load"),
        (SOUND.replace("<worldbody>", '<asset><mesh file="gone.stl"/></asset><worldbody>'), "gone.stl: No such file"),
        (SOUND + " " * 2**26, "expected files of at most 64 MB together"),
    ],
)
def test_a_model_that_cannot_be_used_is_refused_before_anything_is_made(
    text: str | None, named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if text is not None:
        write(tmp_path / "robot.xml", text)
    check_refusal(["train", *COMMON, "task.model=robot.xml"], ["task.model", named], tmp_path, capfd)


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ("task.model=hexapod linkage=feedback wiring.central=false", "linkage"),
        ("task.model=humanoid wiring.central=false", "wiring.trunk: expected module, as nothing else drives abdomen_y"),
        ("task.model=ant wiring.trunk=module", "wiring.trunk: expected none or shared"),
        ("task.model=ant wiring.trunk=shared wiring.central=true", "wiring.trunk"),
        ("task.model=walker2d geometry=fb", "geometry: expected parts that all stand in front or behind"),
        ("task.model=hexapod task.control_period=0.013", "task.control_period: expected a multiple"),
        ("task.model=hexapod task.control_period=0", "task.control_period: expected a multiple"),
        ("task.model=hexapod task.control_period=x", "task.control_period: expected a number from 0 to 10, got 'x'"),
        ("task.model=hexapod task.control_period=1e300", "task.control_period: expected a number from 0 to 10"),
        ("task.model=null", "task.model: expected an MJCF file, or the name of a model, got None"),
        ("task.model=hexapod task.parts=[1]", "task.parts: expected a section"),
        ("task.model=hexapod task.parts={a:[]}", "task.parts.a: expected a list of names of bodies, e.g. [thigh], got"),
        ("task.model=hexapod task.parts={a:front_left}", "task.parts.a: expected a list of names of bodies"),
        ("task.model=hexapod task.parts={a:[3]}", "task.parts.a: expected a list of names of bodies"),
        ("task.model=hopper task.symmetry=mirror", "task.symmetry: expected null, as this body is built, got 'mirror'"),
        ("task=hunting wiring.trunk=shared", "wiring.trunk: expected none"),
        ("task=hunting geometry=auto", "geometry: expected single, all or custom"),
    ],
)
def test_what_does_not_fit_a_body_is_refused(
    settings: str, named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    common = ["budget=smoke"] if "task=hunting" in settings else COMMON
    check_refusal(["train", *common, *settings.split()], [named], tmp_path, capfd)


def test_a_model_of_ones_own_is_kept_with_its_run_and_may_not_change_in_between(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model = write(tmp_path / "dog.xml")
    train = ["train", *COMMON, model, "geometry=auto", "linkage=joints", "wiring.trunk=shared"]
    assert main(train) == 0
    assert "fl 0, fr 0, bl 0, br 0" in capsys.readouterr().err
    (run,) = (tmp_path / "outputs" / "robot").iterdir()
    assert (run / "model" / "dog.xml").read_text() == SOUND
    write(tmp_path / "dog.xml", SOUND.replace('gear="5"', 'gear="6"'))
    assert main([*train, "resume=true", "generations=3"]) == 2
    assert "the task's files have changed" in capsys.readouterr().err
    (tmp_path / "dog.xml").unlink()
    assert main(["evaluate", f"run={run}", "sweep=reset_noise", "sweep.levels=[0.0]", "sweep.episodes=1"]) == 0
    assert (run / "robustness.csv").exists()


@pytest.mark.parametrize("model", ["hexapod", "half_cheetah"])
def test_noise_on_sensors_and_poses_changes_a_robots_test_from_the_unperturbed_one_on(
    model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["train", *COMMON, f"task.model={model}"]) == 0
    (run,) = (tmp_path / "outputs" / "robot").iterdir()
    for sweep in ("sensor_noise", "reset_noise"):
        levels = ["sweep.levels=[0.0,0.1,0.3]", "sweep.episodes=2"]
        assert main(["evaluate", f"run={run}", f"sweep={sweep}", *levels]) == 0
    rows = read_robustness(run / "robustness.csv")
    scores = {(row.parameter, row.level): (row.fitness_mean, row.fitness_std) for row in rows}
    test = read_champion(run / "champion.json").scores.test
    assert test.episodes == 2
    assert [level for level, score in scores.items() if score == (test.fitness_mean, test.fitness_std)] == [
        ("reset_noise", 0.1),  # the model's own
        ("sensor_noise", 0.0),
    ]
    assert len(set(scores.values())) == 5


def test_inspect_shows_parts_and_geometries_before_any_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["inspect", "task=robot", write(tmp_path / "dog.xml")]) == 0
    shown = capsys.readouterr().out
    assert "class    0: a mirror of fl" in shown
    assert "fl_hip position (rad)" in shown
    assert "auto      0 0 0 0" in shown
    assert "fb        0 0 1 1" in shown
    assert list(tmp_path.iterdir()) == [tmp_path / "dog.xml"]
