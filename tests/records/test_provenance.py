"""What a result was made with."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import exneat_cli
from exneat_cli.records import provenance


def git(directory: Path, *arguments: str) -> str:
    command = ["git", "-C", str(directory), "-c", "user.name=a", "-c", "user.email=a@b", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def test_the_commit_is_that_of_the_checkout_whatever_repository_the_environment_names(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours, other = tmp_path / "ours", tmp_path / "other"
    for place in (ours, other):
        git(tmp_path, "init", "--quiet", str(place))
        git(place, "commit", "--quiet", "--allow-empty", "--message", place.name)
    commit = git(ours, "rev-parse", "HEAD")
    (ours / "exneat_cli").mkdir()
    monkeypatch.setattr(exneat_cli, "__file__", str(ours / "exneat_cli" / "__init__.py"))
    monkeypatch.setenv("GIT_DIR", str(other / ".git"))
    monkeypatch.setenv("GIT_WORK_TREE", str(other))
    assert provenance.git_commit() == commit
