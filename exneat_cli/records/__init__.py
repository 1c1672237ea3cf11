"""Everything on disk: layout, columns, champions, checkpoints, manifests, locks."""

from exneat_cli.records import provenance
from exneat_cli.records.files import make_directory, write_json, write_whole
from exneat_cli.records.finding import find_runs, runs_at
from exneat_cli.records.identity import NOT_HASHED, configuration_hash
from exneat_cli.records.manifest import DONE, FAILED, INTERRUPTED, MANIFEST_FORMAT, RUNNING, Manifest, Result, Score
from exneat_cli.records.plain import as_yaml, build, converted, dotted, read_yaml
from exneat_cli.records.published import PublishedRun, publish, published_run, read_published
from exneat_cli.records.run_directory import RunDirectory
from exneat_cli.records.tables import (
    HISTORY_COLUMNS,
    UNPERTURBED,
    HistoryRow,
    RobustnessRow,
    merge_robustness,
    read_robustness,
    write_csv,
    write_history,
)
