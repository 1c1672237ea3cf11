"""neat-python's genome, with initial hidden nodes that are homologous."""

from __future__ import annotations

import neat
from neat.genome import DefaultGenomeConfig

from exneat_cli.algorithms.neat.counter import Counter


class HomologousGenome(neat.DefaultGenome):  # type: ignore[misc]
    """A genome whose initial hidden nodes have the same ids in every genome of a subpopulation.

    neat-python counts on from genome to genome, so that no two initial genomes share a hidden node:
    crossover and distance then see nothing in common, and every genome founds a species of its own.
    """

    def configure_new(self, config: DefaultGenomeConfig) -> None:
        """Make an initial genome; nodes that mutations add later still get ids of their own."""
        first_hidden = config.num_outputs
        later_nodes = config.node_indexer or Counter(first_hidden + config.num_hidden)
        config.node_indexer = Counter(first_hidden)
        super().configure_new(config)
        config.node_indexer = later_nodes
        if config.positive_start:
            for gene in self.connections.values():
                gene.weight = abs(gene.weight)
