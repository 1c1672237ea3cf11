"""What a refusal looks like, whatever was wrong: exit code 2, one to three lines, and nothing left behind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from exneat_cli.main import main

LONGEST = 3
TASK = b"""# @package _global_
defaults:
  - /evolution: recurrent
task:
  name: track_maze
  size: 7
budgets:
  smoke: {generations: 1, population: 6, episodes: 1, validation_episodes: 1, test_episodes: 1, sweep_episodes: 1}
"""
"""A task file of a user's own that is sound."""


def check_message(code: int, message: str, *named: str) -> None:
    """Assert that a command refused in our words, and named what it should."""
    assert code == 2, message
    assert message.startswith("exneat:"), message
    assert 1 <= len(message.strip().splitlines()) <= LONGEST, message
    assert max(map(len, message.splitlines())) < 600
    assert "Traceback" not in message
    assert message.replace("\n", "").isprintable()
    for fragment in named:
        assert fragment in message, message


def check_refusal(
    arguments: Sequence[str], named: Sequence[str], folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Run a command in `folder`, and assert that it was refused and changed nothing."""
    before = contents(folder)
    capfd.readouterr()
    code = main(list(arguments))
    captured = capfd.readouterr()
    check_message(code, captured.err, *named)
    assert not captured.out
    assert contents(folder) == before


def contents(folder: Path) -> dict[str, bytes | None]:
    """Every file below a folder with its bytes, every directory and pipe without."""
    return {str(path.relative_to(folder)): path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}
