"""The story of a run: training, validation, test, robustness. Works from plain objects, without Hydra."""

from exneat_cli.runs.progress import Lines, Progress, progress_for_terminal
from exneat_cli.runs.robustness import check_sweeps, is_finished, load_settings, run_robustness
from exneat_cli.runs.run import Finished, train
from exneat_cli.runs.scores import summary_sentence
from exneat_cli.runs.settings import RunSettings

__all__ = [
    "Finished",
    "Lines",
    "Progress",
    "RunSettings",
    "check_sweeps",
    "is_finished",
    "load_settings",
    "progress_for_terminal",
    "run_robustness",
    "summary_sentence",
    "train",
]
