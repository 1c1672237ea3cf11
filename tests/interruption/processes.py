"""Code that runs in a process of its own, where it may be ended."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path


def in_process(code: str) -> subprocess.CompletedProcess[str]:
    prelude = (
        "import os, signal, subprocess, sys, time\nfrom exneat_cli.interruption import finishing, listen\nlisten()\n"
    )
    return subprocess.run(
        [sys.executable, "-c", prelude + textwrap.dedent(code)], capture_output=True, text=True, timeout=60, check=False
    )


def is_running(process: int) -> bool:
    try:
        return ") Z " not in Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return False
