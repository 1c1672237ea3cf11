"""Everything on disk: layout, columns, champions, checkpoints, manifests, locks."""

from exneat_cli.records import provenance
from exneat_cli.records.champion import Champion, Genome, Scores, read_champion, write_hall_of_fame
from exneat_cli.records.checkpoint import Checkpoint, read_checkpoints, write_checkpoint
from exneat_cli.records.files import make_directory, write_csv, write_json, write_whole
from exneat_cli.records.history import HISTORY_COLUMNS, HistoryRow, write_history
from exneat_cli.records.locks import is_held
from exneat_cli.records.manifest import (
    DONE,
    FAILED,
    INTERRUPTED,
    MANIFEST_FORMAT,
    RUNNING,
    Manifest,
    Result,
    Score,
)
from exneat_cli.records.plain import build, converted
from exneat_cli.records.robustness import UNPERTURBED, RobustnessRow, merge_robustness, read_robustness
from exneat_cli.records.run_directory import RunDirectory, configuration_hash, find_runs
from exneat_cli.records.yaml_files import read_yaml

__all__ = [
    "DONE",
    "FAILED",
    "HISTORY_COLUMNS",
    "INTERRUPTED",
    "MANIFEST_FORMAT",
    "RUNNING",
    "UNPERTURBED",
    "Champion",
    "Checkpoint",
    "Genome",
    "HistoryRow",
    "Manifest",
    "Result",
    "RobustnessRow",
    "RunDirectory",
    "Score",
    "Scores",
    "build",
    "configuration_hash",
    "converted",
    "find_runs",
    "is_held",
    "make_directory",
    "merge_robustness",
    "provenance",
    "read_champion",
    "read_checkpoints",
    "read_robustness",
    "read_yaml",
    "write_checkpoint",
    "write_csv",
    "write_hall_of_fame",
    "write_history",
    "write_json",
    "write_whole",
]
