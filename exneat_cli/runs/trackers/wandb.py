"""Weights & Biases: offline unless WANDB_MODE=online is set; ``wandb sync <run>/wandb/offline-*`` sends a run later.

A resumed run is written anew from history.csv when offline; a server gets the steps that it lacks.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import wandb

from exneat_cli.records import HistoryRow, RunDirectory, configuration_hash


class OneRun:
    """A run of the project ``exneat`` (or WANDB_PROJECT), in ``<run>/wandb``; its id is made from its settings."""

    def __init__(self, run: RunDirectory, settings: Mapping[str, Any], history: Sequence[HistoryRow]) -> None:
        mode = os.environ.get("WANDB_MODE", "offline")
        if mode != "online":
            shutil.rmtree(run.path / "wandb", ignore_errors=True)
        self._run: Any = wandb.init(
            project=os.environ.get("WANDB_PROJECT", "exneat"),
            group=run.path.parent.name,
            name=run.path.name,
            id=f"{run.path.parent.name}-{configuration_hash(settings)[:16]}",
            dir=run.path,
            config=dict(settings),
            mode=mode,
            resume="allow",
            reinit="create_new",
            settings=wandb.Settings(silent=True, console="off"),
        )
        known = self._run.step
        for row in history:
            if row["generation"] >= known:
                self.generation(row)

    def generation(self, row: HistoryRow) -> None:
        """Log a row."""
        self._run.log({name: value for name, value in row.items() if name != "generation"}, step=int(row["generation"]))

    def result(self, figures: Mapping[str, float]) -> None:
        """Put the result into the run's summary."""
        self._run.summary.update({f"result/{name}": value for name, value in figures.items()})

    def pictures(self, paths: Sequence[Path]) -> None:
        """Log figures and films."""
        kinds = {".png": wandb.Image, ".mp4": wandb.Video}
        self._run.log({f"figures/{path.stem}": kinds[path.suffix](str(path)) for path in paths})

    def close(self) -> None:
        """Finish the run."""
        self._run.finish()
