"""Tests, and the benchmark that `make bench` runs."""
