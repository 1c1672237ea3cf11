"""The hot room: runs episodes and returns what came out of them; writes nothing."""

from exneat_cli.rollouts.noise import Noise
from exneat_cli.rollouts.robustness import Sweep, perturbed, run_levels
from exneat_cli.rollouts.runner import EXECUTORS, Executor, Outcomes, Runner, Trace

__all__ = ["EXECUTORS", "Executor", "Noise", "Outcomes", "Runner", "Sweep", "Trace", "perturbed", "run_levels"]
