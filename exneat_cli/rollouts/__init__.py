"""The hot room: runs episodes and returns what came out of them; writes nothing."""

from exneat_cli.rollouts.noise import Noise
from exneat_cli.rollouts.runner import EXECUTORS, Executor, Outcomes, Runner, Trace

__all__ = ["EXECUTORS", "Executor", "Noise", "Outcomes", "Runner", "Trace"]
