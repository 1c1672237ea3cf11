"""`exneat doctor`: each state of each line, its remedy, the exit code, and nothing left behind."""

from __future__ import annotations

import importlib
import itertools
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

import pytest
from exneat_cli.tasks.robots.simulator_trial import Physics

from exneat_cli import compiling
from exneat_cli.commands import findings, installation
from exneat_cli.commands.doctor import LEAST_DISK, LEAST_MEMORY
from exneat_cli.errors import ExneatError
from exneat_cli.main import main
from exneat_cli.records import disk, provenance
from exneat_cli.tasks.robots import simulator_trial

Ask = Callable[..., tuple[int, dict[str, str], str]]
LINE = re.compile(r"^(ok|degraded|broken) +(\S+(?: \S+)*?)(?:  +|$)", re.MULTILINE)


@pytest.fixture
def ask(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Ask:
    """Runs the doctor with a MuJoCo that works at once; gives exit code, state by name, and all that was printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(simulator_trial, "try_physics", lambda: Physics("4.0.0", True, ""))
    monkeypatch.setattr(simulator_trial, "try_rendering", lambda: "egl")

    def doctor(*arguments: str) -> tuple[int, dict[str, str], str]:
        code = main(["doctor", *arguments])
        captured = capfd.readouterr()
        assert not captured.err
        assert "Traceback" not in captured.out
        states = {name: state for state, name in LINE.findall(captured.out)}
        assert_remedies_stand_below_what_is_not_ok(captured.out)
        counted = [list(states.values()).count(state) for state in (findings.OK, findings.DEGRADED, findings.BROKEN)]
        closing = captured.out.splitlines()[-1]
        assert closing.startswith("{} ok, {} degraded, {} broken: ".format(*counted)), captured.out
        assert code == (1 if counted[2] else 0)
        assert ("is fit for exneat." in closing) == (code == 0)
        return code, states, captured.out

    return doctor


def assert_remedies_stand_below_what_is_not_ok(printed: str) -> None:
    lines = printed.splitlines()
    for line, below in itertools.pairwise(lines):
        assert line.startswith(("degraded", "broken")) == below.startswith(" " * 10 + "remedy: "), printed


def raising(error: BaseException) -> Callable[..., object]:
    def fail(*arguments: object, **options: object) -> object:
        raise error

    return fail


def test_everything_is_looked_at_and_nothing_is_left_behind(ask: Ask, tmp_path: Path) -> None:
    _, states, printed = ask()
    required = [text for text in metadata.requires("exneat") or [] if "extra ==" not in text]
    assert len(required) > 10
    for name in ("python", "extra joblib", "extra dask", "extra slurm", "loading", "processor", "memory"):
        assert name in states, printed
    for name in ("compiled MuJoCo", "rendering", "compile cache", "output root", "locks", "disk space"):
        assert name in states, printed
    for text in required:
        assert re.split(r"[^A-Za-z0-9-]", text)[0] in states, printed
    assert findings.BROKEN not in states.values(), printed
    assert not list(tmp_path.iterdir())


def test_an_output_root_that_is_there_keeps_what_it_holds(ask: Ask, tmp_path: Path) -> None:
    (tmp_path / "runs" / "ant").mkdir(parents=True)
    _, states, printed = ask("output=runs")
    assert states["output root"] == findings.OK
    assert "output=runs can be written" in printed
    assert [path.relative_to(tmp_path) for path in tmp_path.rglob("*")] == [Path("runs"), Path("runs/ant")]


def installed(monkeypatch: pytest.MonkeyPatch, **versions: str | None) -> None:
    """Pretend that libraries (``-`` spelt ``_``) have these versions, or are missing (None)."""
    real = metadata.version

    def version(name: str) -> str:
        if (key := name.replace("-", "_")) in versions:
            if (pretended := versions[key]) is None:
                raise metadata.PackageNotFoundError(name)
            return pretended
        return real(name)

    monkeypatch.setattr(installation.metadata, "version", version)


def test_a_missing_library_is_broken_and_named_with_the_command_that_installs_it(
    ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed(monkeypatch, neat_python=None)
    code, states, printed = ask()
    assert (code, states["neat-python"]) == (1, findings.BROKEN)
    assert f"remedy: {sys.executable} -m pip install neat-python==2.0.0" in printed


@pytest.mark.parametrize("version", ["1.26.4", "3.0.0"])
def test_a_library_outside_its_range_is_degraded(version: str, ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, numpy=version)
    code, states, printed = ask()
    assert (code, states["numpy"]) == (0, findings.DEGRADED)
    assert f"{version}, but exneat needs >=2.4,<3" in printed


def test_a_version_that_is_none_is_a_line_of_its_own(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, numpy="unreadable", scipy="1.17.1")
    _, states, printed = ask()
    assert states["numpy"] in (findings.DEGRADED, findings.BROKEN), printed
    assert states["scipy"] == findings.OK


def test_an_extra_may_be_missing_but_not_of_another_version(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    installed(monkeypatch, hydra_joblib_launcher=None, hydra_submitit_launcher="1.1.0")
    code, states, printed = ask()
    assert (code, states["extra joblib"], states["extra slurm"]) == (0, findings.OK, findings.DEGRADED)
    assert "not installed; for runs side by side on one machine:" in printed
    assert "pip install hydra-joblib-launcher==1.2.0" in printed


def test_another_python_than_the_supported_ones_is_broken(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(installation.sys, "version_info", (3, 14, 0, "final", 0))
    code, states, _ = ask()
    assert (code, states["python"]) == (1, findings.BROKEN)


def test_without_metadata_the_needed_versions_are_not_known(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = raising(metadata.PackageNotFoundError("exneat"))
    monkeypatch.setattr(installation.metadata, "requires", missing)
    monkeypatch.setattr(installation.metadata, "metadata", missing)
    code, states, _ = ask()
    assert (code, states["libraries"], states["python"]) == (0, findings.DEGRADED, findings.OK)


def test_a_part_that_cannot_be_loaded_is_broken_and_the_rest_is_left_alone(
    ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = importlib.import_module
    failing = raising(ImportError("libGL.so.1: cannot open shared object file"))
    monkeypatch.setattr(
        installation.importlib, "import_module", lambda name: failing() if name == "exneat_cli.analysis" else real(name)
    )
    _, states, printed = ask()
    assert states["loading"] == findings.BROKEN
    assert "so the rest was not looked at: ImportError: libGL.so.1" in printed
    assert "rendering" not in states


def test_ant_over_gymnasium_is_degraded(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulator_trial, "try_physics", lambda: Physics("4.0.0", False, "no MuJoCo library"))
    code, states, printed = ask()
    assert (code, states["compiled MuJoCo"]) == (0, findings.DEGRADED)
    assert "no MuJoCo library" in printed


def test_an_ant_that_cannot_be_stepped_at_all_is_broken(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulator_trial, "try_physics", raising(ExneatError("its process was ended by SIGSEGV")))
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    code, states, printed = ask()
    assert (code, states["compiled MuJoCo"]) == (1, findings.BROKEN)
    assert "ended by SIGSEGV" in printed
    assert "unset NUMBA_DISABLE_JIT" in printed


def test_rendering_that_fails_is_degraded(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulator_trial, "try_rendering", raising(ExneatError("no answer within 60 s")))
    code, states, printed = ask()
    assert (code, states["rendering"]) == (0, findings.DEGRADED)
    assert "apt-get install libegl1 libopengl0 libgl1-mesa-dri, and set MUJOCO_GL=egl" in printed


def test_little_memory_is_degraded_and_untold_memory_is_not(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    for available, state in ((LEAST_MEMORY, findings.OK), (LEAST_MEMORY - 1, findings.DEGRADED), (None, findings.OK)):
        monkeypatch.setattr(provenance, "available_memory", lambda available=available: available)
        assert ask()[1]["memory"] == state


def test_a_cache_that_cannot_be_written_is_degraded(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(blocked))
    compiling.cache_directory.cache_clear()
    try:
        code, states, printed = ask()
    finally:
        compiling.cache_directory.cache_clear()
    assert (code, states["compile cache"]) == (0, findings.DEGRADED)
    assert f"{blocked} cannot be written to" in printed


def test_a_user_without_a_home_has_no_cache(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiling, "cache_directory", lambda: None)
    monkeypatch.setattr(compiling, "cache_root", raising(RuntimeError("Could not determine home directory.")))
    assert ask()[1]["compile cache"] == findings.DEGRADED


def test_an_output_root_that_is_a_file_is_broken(ask: Ask, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code, states, printed = ask("output=file")
    assert (code, states["output root"]) == (1, findings.BROKEN)
    assert "is a file" in printed
    assert "locks" not in states


def test_a_read_only_output_root_is_broken(ask: Ask, tmp_path: Path) -> None:
    root = Path("/proc/exneat") if os.getuid() == 0 else tmp_path / "outputs"
    tmp_path.chmod(0o700 if os.getuid() == 0 else 0o500)
    if not root.parent.exists():
        pytest.skip("root may write everywhere")
    code, states, _ = ask(f"output={root}")
    assert (code, states["output root"]) == (1, findings.BROKEN)


def test_a_nearly_full_disk_is_degraded(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = type(shutil.disk_usage("."))
    for free, state in ((LEAST_DISK, findings.OK), (LEAST_DISK - 1, findings.DEGRADED)):
        monkeypatch.setattr(shutil, "disk_usage", lambda place, free=free: usage(2 * LEAST_DISK, 0, free))
        assert ask()[1]["disk space"] == state


@pytest.mark.parametrize(
    ("locks", "state", "code"),
    [(lambda root: False, findings.DEGRADED, 0), (raising(ExneatError("No locks available")), findings.BROKEN, 1)],
    ids=["granted twice", "refused"],
)
def test_locks_that_do_not_work_are_told(
    locks: Callable[..., object], state: str, code: int, ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk, "locks_exclude", locks)
    found, states, _ = ask()
    assert (found, states["locks"]) == (code, state)


def test_a_check_that_crashes_is_a_broken_line_and_the_next_one_is_made(
    ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(provenance, "processor", raising(ZeroDivisionError("two\nlines")))
    monkeypatch.setattr(simulator_trial, "try_rendering", raising(OSError(12, "Cannot allocate memory")))
    code, states, printed = ask()
    assert (code, states["processor"], states["rendering"]) == (1, findings.BROKEN, findings.BROKEN)
    assert "could not be checked: ZeroDivisionError: two lines" in printed
    assert states["memory"] == findings.OK


def test_the_doctor_tries_out_the_real_machine_without_a_traceback(tmp_path: Path) -> None:
    code = "import sys; from exneat_cli.main import main; sys.exit(main(['doctor']))"
    environment = {**os.environ, "MUJOCO_GL": "off"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    states = {name: state for state, name in LINE.findall(done.stdout)}
    assert states["compiled MuJoCo"] in (findings.OK, findings.DEGRADED), done.stdout
    assert states["rendering"] == findings.DEGRADED
    assert done.returncode == (1 if findings.BROKEN in states.values() else 0)
    assert not done.stderr
    assert not list(tmp_path.iterdir())


def test_what_names_missing_libraries_needs_none_of_them() -> None:
    code = (
        "import sys\n"
        "from exneat_cli.commands import doctor\n"
        "names = ('numpy', 'numba', 'mujoco', 'gymnasium', 'neat', 'pandas', 'matplotlib', 'hydra', 'yaml')\n"
        "print([name for name in names if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_help_lists_the_doctor_and_says_what_it_takes(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    assert "  doctor " in capfd.readouterr().out
    assert main(["doctor", "--help"]) == 0
    assert "usage: exneat doctor [output=" in capfd.readouterr().out
