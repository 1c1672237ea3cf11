"""Whether array genomes evolve as well as neat-python's own: `python -m tests.equivalence`."""
