"""Genomes in arrays, their operators, and what neat-python does with them: species, stagnation, reproduction."""
