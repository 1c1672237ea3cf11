"""Wiring: geometry, linkage, and the plan of what each module senses and drives. Pure data."""

from exneat_cli.wiring.linkage import LINKAGES, Linkage, peers_of
from exneat_cli.wiring.moments import Moments, merged, pooled_by_pin, with_sensed
from exneat_cli.wiring.plan import CENTRAL, Module, Pin, Plan
from exneat_cli.wiring.planning import GEOMETRIES, Geometry, Wiring, plan_body, plan_modules, refuse_modules
