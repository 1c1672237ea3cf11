"""Rollouts: runs episodes and returns their outcomes; writes no files. Most of a run's time is spent here."""

from exneat_cli.rollouts.episode import Recording, record
from exneat_cli.rollouts.runner import Outcomes, Runner, Trace
from exneat_cli.rollouts.settings import Executor, Noise, Sweep, is_compiled, perturbed
from exneat_cli.rollouts.workers import keep_workers
