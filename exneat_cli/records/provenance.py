"""What a result was made with: versions, processor, commit."""

from __future__ import annotations

import platform
import subprocess
from importlib.metadata import version
from pathlib import Path

import exneat_cli

_PACKAGES = ("neat-python", "numpy", "numba", "gymnasium", "mujoco", "hydra-core")


def versions() -> dict[str, str]:
    """Versions of exneat, Python and the libraries that results depend on."""
    return {
        "exneat": exneat_cli.__version__,
        "python": platform.python_version(),
        **{package: version(package) for package in _PACKAGES},
    }


def processor() -> str:
    """The processor's name as the system tells it."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def available_memory() -> int | None:
    """Bytes of memory that a new process may take without others being swapped out; None where it is not told."""
    try:
        for line in Path("/proc/meminfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except OSError:
        pass
    return None


def git_commit() -> str | None:
    """Commit of the checkout that exneat runs from, with ``-dirty`` if it was changed; None if installed."""
    root = Path(exneat_cli.__file__).parents[1]
    if not (root / ".git").exists():
        return None
    try:
        commit = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--abbrev=40", "--dirty", "--exclude=*"],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return commit.stdout.strip()
