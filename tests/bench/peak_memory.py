"""Runs a command and prints the most resident memory that it had, in bytes; its exit code is the command's.

A process of its own, because Linux counts what the parent held when a child was started as the child's:
started by the benchmark itself, every command would seem to need at least what the benchmark needs.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence


def main(command: Sequence[str]) -> int:
    """Run `command` without its output and print its peak resident memory in bytes."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    bytes_per_unit = 1 if sys.platform == "darwin" else 1024
    print(usage.ru_maxrss * bytes_per_unit)
    return process.returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
