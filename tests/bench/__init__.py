"""How fast episodes and trainings are, most of it as ratios measured side by side: `python -m tests.bench`."""
