"""CSV files become statistics, tables and plots; genomes and simulators are never touched."""

from exneat_cli.analysis.run_figures import draw_path, draw_training

__all__ = ["draw_path", "draw_training"]
