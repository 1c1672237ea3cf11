"""Ask/tell over subpopulations: the only room that calls neat-python's evolution."""

from exneat_cli.evolution.array_genome import ArrayGenome
from exneat_cli.evolution.coevolution import PAIRINGS, Coevolution, Snapshot, Team
from exneat_cli.evolution.conversion import from_stock, to_stock
from exneat_cli.evolution.genes import ACTIVATIONS
from exneat_cli.evolution.genome_data import genome_from_data, genome_to_data
from exneat_cli.evolution.hall_of_fame import Entry, HallOfFame
from exneat_cli.evolution.packing import Columns, pack, unpack
from exneat_cli.evolution.settings import RECURRENT, EvolutionSettings, neat_config
from exneat_cli.evolution.soundness import check_genome

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
