"""MLflow: on the server of MLFLOW_TRACKING_URI, else in ``<output>/mlruns``, which ``mlflow ui`` shows.

When a run is resumed, MLflow is asked which steps of each column it has, and gets the others.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mlflow.entities import Metric, Param
from mlflow.tracking import MlflowClient

from exneat_cli.records import HistoryRow, RunDirectory, configuration_hash, dotted

_TAG = "exneat.run"
_MOST_PARAMS, _LONGEST_PARAM = 100, 500  # MLflow's limits: per request, and characters
_DEFAULTS = {
    "MLFLOW_ALLOW_FILE_STORE": "true",  # newer versions of MLflow want to be told that files suffice without a server
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "3",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "20",
}
"""Set unless the user has set them. By itself, MLflow would hold up a run for four minutes if a server is gone, and for
a quarter of an hour if it does not answer; with these settings it takes 12 s and a minute and a half."""


class OneRun:
    """A run in the experiment named after the run's folder, found again by a tag."""

    def __init__(self, run: RunDirectory, settings: Mapping[str, Any], history: Sequence[HistoryRow]) -> None:
        local = (run.path.parent.parent / "mlruns").absolute().as_uri()
        for name, value in _DEFAULTS.items():
            os.environ.setdefault(name, value)
        self._client = MlflowClient(os.environ.get("MLFLOW_TRACKING_URI", local))
        name, mark = run.path.parent.name, configuration_hash(settings)
        experiment = self._client.get_experiment_by_name(name)
        place = experiment.experiment_id if experiment else self._client.create_experiment(name)
        found = self._client.search_runs([place], f"tags.`{_TAG}` = '{mark}'")
        if found:
            self._id = found[0].info.run_id
            self._client.update_run(self._id, "RUNNING")
        else:
            self._id = self._client.create_run(place, run_name=run.path.name, tags={_TAG: mark}).info.run_id
            params = [Param(key, str(value)[:_LONGEST_PARAM]) for key, value in dotted(settings).items()]
            for first in range(0, len(params), _MOST_PARAMS):
                self._client.log_batch(self._id, params=params[first : first + _MOST_PARAMS])
        known = {column: self._steps(column) for column in (history[0] if found and history else ())}
        for row in history:
            self._log({name: value for name, value in row.items() if row["generation"] not in known.get(name, ())}, row)
        self._has_result = bool(found) and bool(self._steps("result.champion.fitness_mean"))

    def _steps(self, column: str) -> set[int]:
        return {metric.step for metric in self._client.get_metric_history(self._id, column)}

    def _log(self, figures: Mapping[str, float], row: Mapping[str, float]) -> None:
        now, step = int(1000 * time.time()), int(row["generation"])
        metrics = [Metric(name, value, now, step) for name, value in figures.items() if name != "generation"]
        self._client.log_batch(self._id, metrics=metrics)
        self._last = row

    def generation(self, row: HistoryRow) -> None:
        """Log a row."""
        self._log(row, row)

    def result(self, figures: Mapping[str, float]) -> None:
        """Log the result, unless it is there."""
        if not self._has_result:
            named = {f"result.{name.replace('/', '.')}": value for name, value in figures.items()}
            self._log(named, getattr(self, "_last", {"generation": 0}))

    def pictures(self, paths: Sequence[Path]) -> None:
        """Keep figures and films as artefacts."""
        for path in paths:
            self._client.log_artifact(self._id, str(path), "figures")

    def close(self) -> None:
        """Mark the run as over."""
        self._client.set_terminated(self._id)
