"""`exneat doctor`: each state of each line, its remedy, the exit code, and nothing left behind."""

from __future__ import annotations

import errno
import fcntl
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

from exneat_cli import compiling
from exneat_cli.commands import doctor
from exneat_cli.commands.doctor import BROKEN, DEGRADED, LEAST, OK, said_by
from exneat_cli.errors import ExneatError
from exneat_cli.main import main
from exneat_cli.records import provenance

Ask = Callable[..., tuple[int, dict[str, str], str]]
LINE = re.compile(r"^(ok|degraded|broken) +(\S+(?: \S+)*?)(?:  +|$)", re.MULTILINE)
NAMES = [
    *("python", "packages", "loading", "compiled MuJoCo", "rendering", "compile cache", "output root"),
    *("memory", "disk space"),
]


@pytest.fixture
def ask(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Ask:
    """Runs the doctor with processes that find all well; gives exit code, state by name, and all that was printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(doctor, "said_by", lambda *arguments, **options: "well")

    def run(*arguments: str) -> tuple[int, dict[str, str], str]:
        code = main(["doctor", *arguments])
        captured = capfd.readouterr()
        assert not captured.err
        assert "Traceback" not in captured.out
        states = {name: state for state, name in LINE.findall(captured.out)}
        lines = captured.out.splitlines()
        for line, below in itertools.pairwise(lines):
            if line.startswith((OK, DEGRADED, BROKEN)) and not below.startswith(" " * 27):
                assert line.startswith((DEGRADED, BROKEN)) == below.startswith(" " * 10 + "remedy: "), captured.out
        counted = [list(states.values()).count(state) for state in (OK, DEGRADED, BROKEN)]
        assert lines[-1].startswith("{} ok, {} degraded, {} broken: ".format(*counted)), captured.out
        assert code == (1 if counted[2] else 0)
        assert ("is fit for exneat." in lines[-1]) == (code == 0)
        return code, states, captured.out

    return run


def raising(error: BaseException) -> Callable[..., object]:
    def fail(*arguments: object, **options: object) -> object:
        raise error

    return fail


def test_everything_is_looked_at_and_nothing_is_left_behind(ask: Ask, tmp_path: Path) -> None:
    _, states, printed = ask()
    assert list(states) == NAMES, printed
    assert set(states.values()) == {OK}, printed
    assert "neat-python 2.0.0" in printed
    assert not list(tmp_path.iterdir())
    (tmp_path / "runs" / "ant").mkdir(parents=True)
    _, _, printed = ask("output=runs")
    assert "output=runs can be written" in printed
    assert [path.relative_to(tmp_path) for path in tmp_path.rglob("*")] == [Path("runs"), Path("runs/ant")]


def test_what_pip_says_of_the_packages_is_shown_line_by_line(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    said = "exneat 0.1 requires numba, which is not installed.\nexneat 0.1 has requirement numpy, but you have 1.26."
    monkeypatch.setattr(
        doctor, "said_by", lambda arguments, *_, **__: raising(ExneatError(said))() if "pip" in arguments else "well"
    )
    code, states, printed = ask()
    assert (code, states["packages"]) == (0, DEGRADED)
    assert all(line in printed for line in said.splitlines())


def test_a_library_that_is_not_installed_is_named(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    real = metadata.version
    missing = raising(metadata.PackageNotFoundError("numba"))
    monkeypatch.setattr(doctor.metadata, "version", lambda name: missing() if name == "numba" else real(name))
    _, states, printed = ask()
    assert states["python"] == DEGRADED
    assert "No package metadata was found for numba" in printed


def test_a_part_that_cannot_be_loaded_is_broken_and_the_rest_is_left_alone(
    ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, failing = importlib.import_module, raising(ImportError("libGL.so.1: cannot open shared object file"))
    monkeypatch.setattr(
        doctor.importlib, "import_module", lambda name: failing() if name == "exneat_cli.analysis" else real(name)
    )
    _, states, printed = ask()
    assert list(states) == ["python", "packages", "loading"]
    assert states["loading"] == BROKEN
    assert "ImportError: libGL.so.1" in printed


def test_mujoco_that_cannot_be_stepped_is_broken_and_rendering_that_fails_is_degraded(
    ask: Ask, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing = raising(ExneatError("its process was ended by SIGSEGV"))
    monkeypatch.setattr(doctor, "said_by", lambda arguments, *_, **__: failing() if "-c" in arguments else "well")
    code, states, printed = ask()
    assert (code, states["compiled MuJoCo"], states["rendering"]) == (1, BROKEN, DEGRADED)
    assert "ended by SIGSEGV" in printed
    assert "unset NUMBA_DISABLE_JIT" in printed
    assert "apt-get install libegl1 libopengl0 libgl1-mesa-dri, and set MUJOCO_GL=egl" in printed


def test_a_cache_that_cannot_be_written_is_degraded(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(blocked))
    compiling.cache_directory.cache_clear()
    try:
        code, states, printed = ask()
    finally:
        compiling.cache_directory.cache_clear()
    assert (code, states["compile cache"]) == (0, DEGRADED)
    assert f"{blocked} cannot be written to" in printed


def test_an_output_root_that_cannot_be_used_is_broken(ask: Ask, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    if os.getuid():
        (tmp_path / "closed").mkdir(mode=0o500)
    for name in ("file", "file/below", "link/below", "/proc/exneat" if os.getuid() == 0 else "closed"):
        code, states, printed = ask(f"output={name}")
        assert (code, states["output root"]) == (1, BROKEN), printed


def no_locks(*_: object) -> None:
    raise OSError(errno.ENOLCK, "No locks available")


@pytest.mark.parametrize(
    ("lock", "named"), [(no_locks, "No locks available"), (lambda *_: None, "the file system grants a lock twice")]
)
def test_an_output_root_whose_locks_keep_nobody_out_is_broken(
    lock: Callable[..., None], named: str, ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fcntl, "flock", lock)
    code, states, printed = ask()
    assert (code, states["output root"]) == (1, BROKEN)
    assert named in printed
    assert not list(tmp_path.iterdir())


def test_little_memory_and_a_nearly_full_disk_are_degraded(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = type(shutil.disk_usage("."))
    for left, state in ((LEAST, OK), (LEAST - 1, DEGRADED)):
        monkeypatch.setattr(provenance, "available_memory", lambda left=left: left)
        monkeypatch.setattr(shutil, "disk_usage", lambda place, left=left: usage(2 * LEAST, 0, left))
        _, states, _ = ask()
        assert (states["memory"], states["disk space"]) == (state, state)
    monkeypatch.setattr(provenance, "available_memory", lambda: None)
    assert ask()[1]["memory"] == OK


def test_a_check_that_crashes_is_a_line_and_the_next_one_is_made(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provenance, "available_memory", raising(ZeroDivisionError("two\nlines")))
    _, states, printed = ask()
    assert (states["memory"], states["disk space"]) == (DEGRADED, OK)
    assert re.search(r"ZeroDivisionError: two\n {27}lines", printed)


def test_the_real_machine_is_tried_out_without_a_traceback(tmp_path: Path) -> None:
    code = "import sys; from exneat_cli.main import main; sys.exit(main(['doctor']))"
    environment = {**os.environ, "MUJOCO_GL": "off"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    states = {name: state for state, name in LINE.findall(done.stdout)}
    assert states["compiled MuJoCo"] == OK, done.stdout
    assert states["rendering"] == DEGRADED, done.stdout
    assert done.returncode == (1 if BROKEN in states.values() else 0)
    assert not done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import os; os.abort()", "its process was ended by SIGABRT"),
        ("import time; time.sleep(60)", "no answer within 0.5 s"),
        ("raise SystemExit(3)", "exit code 3"),
        ("raise SystemExit('the frame is black')", "the frame is black"),
        ("raise ValueError('no')", "ValueError: no"),
    ],
)
def test_a_process_that_dies_hangs_or_refuses_is_an_error_in_words(code: str, message: str) -> None:
    with pytest.raises(ExneatError, match=f"^{message}$"):
        said_by(["-c", code], seconds=0.5 if "sleep" in code else 60.0)


def test_files_of_the_working_directory_do_not_stand_in_for_libraries(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "json.py").write_text("raise RuntimeError('the wrong json')")
    monkeypatch.chdir(tmp_path)
    assert said_by(["-c", "import json; print('well')"]) == "well"


def test_the_doctor_needs_none_of_the_libraries_that_it_asks_about() -> None:
    code = (
        "import sys\n"
        "from exneat_cli.commands import doctor\n"
        "names = ('numpy', 'numba', 'mujoco', 'gymnasium', 'neat', 'pandas', 'matplotlib')\n"
        "print([name for name in names if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_command_whose_library_is_missing_says_so_in_two_lines(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "hydra", None)
    monkeypatch.delitem(sys.modules, "exneat_cli.commands.command_line")
    assert main(["inspect"]) == 2
    message = capfd.readouterr().err
    assert message.startswith("exneat: import of hydra halted")
    assert message.splitlines()[1].endswith(
        "python -m pip check says which libraries are missing or of another version"
    )
