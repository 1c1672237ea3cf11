"""The hot room: runs episodes and returns what came out of them; writes nothing."""

from exneat_cli.rollouts.episode import Recording, record
from exneat_cli.rollouts.runner import Outcomes, Runner, Trace
from exneat_cli.rollouts.settings import Executor, Noise, Sweep, is_compiled, perturbed
from exneat_cli.rollouts.workers import keep_workers
