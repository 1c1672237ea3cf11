"""Ask/tell over subpopulations: the only room that calls neat-python's evolution."""

from exneat_cli.algorithms.exneat import PAIRINGS, Coevolution, Snapshot, Team
from exneat_cli.algorithms.hall_of_fame import Entry, HallOfFame
from exneat_cli.algorithms.neat.conversion import from_stock, to_stock
from exneat_cli.algorithms.neat.genes import ACTIVATIONS
from exneat_cli.algorithms.neat.genome import ArrayGenome
from exneat_cli.algorithms.neat.genome_data import genome_from_data, genome_to_data
from exneat_cli.algorithms.neat.packing import Columns, pack, unpack
from exneat_cli.algorithms.neat.settings import RECURRENT, EvolutionSettings, neat_config
from exneat_cli.algorithms.neat.soundness import check_genome

__all__ = [
    "ACTIVATIONS",
    "PAIRINGS",
    "RECURRENT",
    "ArrayGenome",
    "Coevolution",
    "Columns",
    "Entry",
    "EvolutionSettings",
    "HallOfFame",
    "Snapshot",
    "Team",
    "check_genome",
    "from_stock",
    "genome_from_data",
    "genome_to_data",
    "neat_config",
    "pack",
    "to_stock",
    "unpack",
]
