"""How fast evolution, episodes and trainings are, most of it as ratios: `python -m tests.bench`."""
