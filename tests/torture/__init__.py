"""Faults of every kind, put upon real runs: see `python -m tests.torture --help`."""
