"""Algorithms with one interface, `Algorithm`: one file (or folder) each, found by name in `ALGORITHMS`."""

from exneat_cli.algorithms.algorithm import Algorithm, Candidate, Problem, Results, Search, State, Team
from exneat_cli.algorithms.ars import ARS
from exneat_cli.algorithms.baselines import BASELINES, Baseline
from exneat_cli.algorithms.candidates import CHAMPIONS
from exneat_cli.algorithms.cma_es import CMAES
from exneat_cli.algorithms.exneat import JUDGINGS, NEAT, Coevolution, ExNEAT
from exneat_cli.algorithms.neat.conversion import from_stock, pack_teams, to_stock, unpack_teams
from exneat_cli.algorithms.neat.genes import ACTIVATIONS
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.neat_python import config_text, neat_config
from exneat_cli.algorithms.neat.settings import RECURRENT, EvolutionSettings
from exneat_cli.algorithms.openai_es import OpenAIES
from exneat_cli.algorithms.pairing import PAIRINGS

ALGORITHMS: dict[str, type[Algorithm]] = {
    "exneat": ExNEAT,
    "neat": NEAT,
    "ars": ARS,
    "openai_es": OpenAIES,
    "cma_es": CMAES,
    **dict.fromkeys(BASELINES, Baseline),
}
"""Every algorithm by the name that it has in `conf/algorithm`."""
