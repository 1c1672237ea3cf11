"""Ask/tell over subpopulations: the only room that calls neat-python's evolution."""

from exneat_cli.evolution.coevolution import PAIRINGS, Coevolution, Team
from exneat_cli.evolution.genome_data import Genome, genome_from_data, genome_to_data
from exneat_cli.evolution.hall_of_fame import Entry, HallOfFame
from exneat_cli.evolution.settings import RECURRENT, EvolutionSettings, neat_config

__all__ = [
    "PAIRINGS",
    "RECURRENT",
    "Coevolution",
    "Entry",
    "EvolutionSettings",
    "Genome",
    "HallOfFame",
    "Team",
    "genome_from_data",
    "genome_to_data",
    "neat_config",
]
