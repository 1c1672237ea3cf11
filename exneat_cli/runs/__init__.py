"""The course of a run: training, validation, test, robustness. Works from plain objects, without Hydra."""

from exneat_cli.runs.progress import Progress, progress_for_terminal
from exneat_cli.runs.robustness import (
    check_sweeps,
    is_finished,
    load_champion,
    load_settings,
    read_settings,
    run_robustness,
)
from exneat_cli.runs.run import Finished, train
from exneat_cli.runs.settings import RunSettings, read_task
from exneat_cli.runs.trackers import tracked
from exneat_cli.runs.watching import Scene, record_champion
