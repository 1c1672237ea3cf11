"""What a result was made with: versions, processor, commit."""

from __future__ import annotations

import contextlib
import functools
import os
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path

import exneat_cli

_version = functools.cache(version)  # which reads a file
_PACKAGES = ("neat-python", "numpy", "numba", "gymnasium", "mujoco", "hydra-core")


def versions() -> dict[str, str]:
    """Versions of exneat, Python and the libraries on which results depend."""
    packages = {package: _version(package) for package in _PACKAGES}
    return {"exneat": exneat_cli.__version__, "python": platform.python_version(), **packages}


def processor() -> str:
    """The processor's name as the system reports it."""
    return _told("/proc/cpuinfo", "model name") or platform.processor() or platform.machine()


def available_memory() -> int | None:
    """Bytes of memory that a new process may take without others being swapped out; None if the system does not say."""
    told = _told("/proc/meminfo", "MemAvailable")
    return int(told.split()[0]) * 1024 if told else None


def _told(path: str, name: str) -> str | None:
    """The value after the first such name in one of the kernel's files."""
    with contextlib.suppress(OSError):
        for line in Path(path).read_text(encoding="utf-8").splitlines():
            if line.startswith(name):
                return line.partition(":")[2].strip()
    return None


def git_commit() -> str | None:
    """Commit of the checkout that exneat runs from, with ``-dirty`` if it was changed; None if installed."""
    root = Path(exneat_cli.__file__).parents[1]
    if not (root / ".git").exists():
        return None
    try:
        commit = _git(root, "rev-parse", "HEAD")
        # Published rows and pages change while runs are made, but no run depends on them.
        changed = _git(root, "diff", "--name-only", "HEAD", "--", ".", ":!experiments/results", ":!docs")
    except (OSError, subprocess.SubprocessError):
        return None
    return f"{commit}-dirty" if changed else commit


def _git(root: Path, *arguments: str) -> str:
    command = ["git", "-C", str(root), *arguments]
    # GIT_DIR and similar variables, which git sets for hooks, would name another repository.
    own = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True, env=own).stdout.strip()
