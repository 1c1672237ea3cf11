"""Tasks of users in modules of the current directory, and a process that has not heard of them."""

from __future__ import annotations

import sys
from pathlib import Path

from exneat_cli.tasks.user_code import NAMED

EXAMPLE = Path(__file__).parents[2] / "examples" / "custom_task.py"
CORRIDOR = EXAMPLE.read_text(encoding="utf-8").replace('TASKS["corridor"] = Corridor', "")
"""The example's task, which does not register itself."""
MARK = '\nfrom pathlib import Path\nPath("imported").touch()\nprint("imported")\n'


def forget_user_code() -> None:
    """Be as a new process, for which its user has named nothing."""
    NAMED.clear()
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None) or "").startswith(str(Path.cwd())):
            del sys.modules[name]
