"""CSV files become statistics, tables and plots; genomes and simulators are never touched."""

from exneat_cli.analysis import loading  # before all that imports matplotlib
from exneat_cli.analysis.network_graph import draw_network
from exneat_cli.analysis.run_figures import draw_path, draw_robustness, draw_training
