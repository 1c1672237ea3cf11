"""Everything on disk: layout, columns, champions, checkpoints, manifests, locks."""

from exneat_cli.records import provenance
from exneat_cli.records.champion import Champion, Genome, Scores, read_champion, write_hall_of_fame
from exneat_cli.records.checkpoint import Checkpoint, read_checkpoints, write_checkpoint
from exneat_cli.records.files import make_directory, write_csv, write_json, write_whole
from exneat_cli.records.history import HISTORY_COLUMNS, HistoryRow, write_history
from exneat_cli.records.locks import is_held
from exneat_cli.records.manifest import DONE, FAILED, INTERRUPTED, MANIFEST_FORMAT, RUNNING, Manifest, Result, Score
from exneat_cli.records.plain import build, converted
from exneat_cli.records.robustness import UNPERTURBED, RobustnessRow, merge_robustness, read_robustness
from exneat_cli.records.run_directory import RunDirectory, configuration_hash, find_runs
from exneat_cli.records.yaml_files import read_yaml
