"""Everything on disk: layout, columns, champions, checkpoints, manifests, locks."""

from exneat_cli.records import provenance
from exneat_cli.records.champion import Champion, read_champion, write_champion, write_hall_of_fame
from exneat_cli.records.champion_data import plan_from_data, read_champion_data
from exneat_cli.records.checkpoint import Checkpoint, read_checkpoints, write_checkpoint
from exneat_cli.records.files import make_directory, read_json, write_csv, write_json, write_whole
from exneat_cli.records.history import HISTORY_COLUMNS, HistoryRow, write_history
from exneat_cli.records.locks import is_held
from exneat_cli.records.manifest_data import DONE, FAILED, INTERRUPTED, RUNNING
from exneat_cli.records.plain import build
from exneat_cli.records.robustness import UNPERTURBED, RobustnessRow, merge_robustness, read_robustness
from exneat_cli.records.run_directory import (
    MANIFEST_FORMAT,
    Claim,
    RunDirectory,
    configuration_hash,
    find_runs,
)
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
    "Claim",
    "HistoryRow",
    "RobustnessRow",
    "RunDirectory",
    "build",
    "configuration_hash",
    "find_runs",
    "is_held",
    "make_directory",
    "merge_robustness",
    "plan_from_data",
    "provenance",
    "read_champion",
    "read_champion_data",
    "read_checkpoints",
    "read_json",
    "read_robustness",
    "read_yaml",
    "write_champion",
    "write_checkpoint",
    "write_csv",
    "write_hall_of_fame",
    "write_history",
    "write_json",
    "write_whole",
]
