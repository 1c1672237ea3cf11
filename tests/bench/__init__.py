"""How fast training on Ant is, as ratios that are measured side by side; run with `python -m tests.bench`."""
