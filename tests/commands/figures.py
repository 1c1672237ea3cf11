"""Runs whose figures nobody looks at."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def without_figures() -> Iterator[None]:
    """Have no run of this process drawn, which takes longer than a small run takes to train."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exneat_cli.commands.jobs.Job.missing_figures", lambda *arguments: [])
        yield
