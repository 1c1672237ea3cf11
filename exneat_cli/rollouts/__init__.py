"""The hot room: runs episodes and returns what came out of them; writes nothing."""

from exneat_cli.rollouts.cluster import keep_clusters
from exneat_cli.rollouts.runner import Outcomes, Runner, Trace
from exneat_cli.rollouts.settings import Executor, Noise, Sweep, perturbed
