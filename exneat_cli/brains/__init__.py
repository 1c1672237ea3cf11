"""Brains: teams and plans as flat arrays for one compiled kernel, and brains that follow a fixed rule."""

from exneat_cli.brains.assembly import assemble, places_in_memory
from exneat_cli.brains.brain import Brains
from exneat_cli.brains.rules import acting_by_rule, linear_fusion, motionless
