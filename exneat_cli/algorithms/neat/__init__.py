"""Genomes in arrays, their operators, and their use by neat-python's species, stagnation and reproduction."""
