"""exneat: train and compare modular neuroevolution (NEAT and ExNEAT) on real simulators."""

__version__ = "0.1.0"
