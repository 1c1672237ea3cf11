"""The hot room: runs episodes and returns what came out of them; writes nothing."""

from exneat_cli.rollouts.cluster import keep_clusters
from exneat_cli.rollouts.executor import Executor
from exneat_cli.rollouts.outcomes import Outcomes, Trace
from exneat_cli.rollouts.perturbation import Noise, Sweep, perturbed
from exneat_cli.rollouts.runner import Runner

__all__ = [
    "Executor",
    "Noise",
    "Outcomes",
    "Runner",
    "Sweep",
    "Trace",
    "keep_clusters",
    "perturbed",
]
