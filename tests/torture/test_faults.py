"""A small part of `make torture`, with limits that only tell hanging from going on."""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence

import pytest

from exneat_cli.main import main
from tests.torture import interruptions
from tests.torture.checkpoints import damage_checkpoints
from tests.torture.disk import fill_disks
from tests.torture.findings import Finding
from tests.torture.interruptions import interrupt
from tests.torture.kills import kill_runs
from tests.torture.races import race


def missed(findings: Sequence[Finding]) -> list[Finding]:
    return [each for each in findings if not each.meets]


def test_runs_that_are_killed_end_with_the_same_bytes() -> None:
    assert not missed(kill_runs(2, seed=1))


def test_runs_that_are_interrupted_end_clean_and_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interruptions, "BAR", 10.0)
    assert not missed(interrupt(2, seed=1))


def test_damaged_checkpoints_are_never_taken_for_sound_ones() -> None:
    assert not missed(damage_checkpoints(20, seed=1))


def test_a_failing_disk_costs_one_line_and_no_result() -> None:
    assert not missed(fill_disks(2, seed=1))


def test_of_two_processes_exactly_one_writes() -> None:
    assert not missed(race(3, seed=1))


def test_a_full_disk_that_a_library_meets_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(name: str) -> object:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("exneat_cli.main.importlib.import_module", full)
    assert main(["doctor"]) == 2
    assert capsys.readouterr().err.startswith("exneat: temporary files: No space left")
