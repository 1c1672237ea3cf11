"""Team and plan become flat arrays for one compiled kernel; also the brains that follow a fixed rule."""

from exneat_cli.brains.assembly import assemble
from exneat_cli.brains.brain import Brain
from exneat_cli.brains.rules import RandomActions, linear_fusion, motionless

__all__ = ["Brain", "RandomActions", "assemble", "linear_fusion", "motionless"]
