"""Who senses and who drives what: geometry, linkage and the plan that follows. Pure data."""

from exneat_cli.wiring.geometry import GEOMETRIES, Geometry
from exneat_cli.wiring.linkage import LINKAGES, counter_clockwise
from exneat_cli.wiring.plan import CENTRAL, Module, Pin, Plan
from exneat_cli.wiring.planning import ALGORITHMS, UNTRAINED, Wiring, plan_wiring

__all__ = [
    "ALGORITHMS",
    "CENTRAL",
    "GEOMETRIES",
    "LINKAGES",
    "UNTRAINED",
    "Geometry",
    "Module",
    "Pin",
    "Plan",
    "Wiring",
    "counter_clockwise",
    "plan_wiring",
]
