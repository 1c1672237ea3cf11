"""neat-python's reproduction, fixed so that no run aborts."""

from __future__ import annotations

from typing import Any

import neat
from neat.species import DefaultSpeciesSet


class SteadyReproduction(neat.DefaultReproduction):  # type: ignore[misc]
    """Reproduction that copes with any number of species.

    neat-python 2.0 stops a run when the species together may claim more than the population, and when
    rounding leaves more than one genome per species to take away. Nothing else is changed.
    """

    def reproduce(
        self, config: neat.Config, species: DefaultSpeciesSet, pop_size: int, generation: int
    ) -> dict[int, Any]:
        """The next generation by id, after elitism and minimum species size were cut to what fits."""
        configured = self.reproduction_config
        elitism, min_species_size = configured.elitism, configured.min_species_size
        share = pop_size // len(species.species)
        configured.elitism = min(elitism, share)
        configured.min_species_size = min(min_species_size, share)
        try:
            genomes: dict[int, Any] = super().reproduce(config, species, pop_size, generation)
            return genomes
        finally:
            configured.elitism, configured.min_species_size = elitism, min_species_size

    def _adjust_spawn_exact(self, spawn_amounts: list[int], pop_size: int, min_species_size: int) -> list[int]:
        amounts = list(spawn_amounts)
        while sum(amounts) > pop_size:
            for index in sorted(range(len(amounts)), key=lambda index: -amounts[index]):
                if sum(amounts) > pop_size and amounts[index] > min_species_size:
                    amounts[index] -= 1
        adjusted: list[int] = super()._adjust_spawn_exact(amounts, pop_size, min_species_size)
        return adjusted
