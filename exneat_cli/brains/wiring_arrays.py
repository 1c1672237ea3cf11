"""A wiring plan as arrays, for compiled code."""

from __future__ import annotations

import functools
import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exneat_cli.wiring import Plan


class WiringArrays(NamedTuple):
    """A plan of M modules with P pins in all, S subpopulations and A actuators.

    Attributes:
        observation_size: length of what is sensed.
        shapes: (S, 3) inputs, initial hidden nodes and outputs.
        hidden_is_linked: (S,) whether other modules read a module's initial hidden nodes.
        subpopulation: (M,) of each module.
        first_pin: (M + 1,) the pins of module m are first_pin[m] to first_pin[m + 1].
        pin_module: (P,) the module that is read; -1 for a sensor.
        pin_index: (P,) which entry of what is sensed, or which node of the module.
        pin_delayed: (P,) whether the value of the previous step is read.
        driver: (A,) the module that sets each actuator; -1 for none.
        driver_output: (A,) which of its outputs.
    """

    observation_size: int
    shapes: NDArray[np.int64]
    hidden_is_linked: NDArray[np.bool_]
    subpopulation: NDArray[np.int64]
    first_pin: NDArray[np.int64]
    pin_module: NDArray[np.int64]
    pin_index: NDArray[np.int64]
    pin_delayed: NDArray[np.bool_]
    driver: NDArray[np.int64]
    driver_output: NDArray[np.int64]


@functools.lru_cache(maxsize=16)
def wiring_arrays(plan: Plan) -> WiringArrays:
    """The arrays of `plan`, which must have at least one module."""
    linked = {module.subpopulation: plan.hidden_is_linked(m) for m, module in enumerate(plan.modules)}
    pins = [pin for module in plan.modules for pin in module.pins]
    driver = np.full(plan.action_size, -1, np.int64)
    driver_output = np.zeros(plan.action_size, np.int64)
    for m, module in enumerate(plan.modules):
        drives = list(module.drives)
        driver[drives] = m
        driver_output[drives] = range(len(drives))
    return WiringArrays(
        observation_size=plan.observation_size,
        shapes=np.array(plan.subpopulation_shapes, np.int64),
        hidden_is_linked=np.array([linked[s] for s in range(len(linked))]),
        subpopulation=np.array([module.subpopulation for module in plan.modules], np.int64),
        first_pin=np.array([*itertools.accumulate((len(m.pins) for m in plan.modules), initial=0)], np.int64),
        pin_module=np.array([pin.module for pin in pins], np.int64),
        pin_index=np.array([pin.index for pin in pins], np.int64),
        pin_delayed=np.array([pin.delayed for pin in pins], np.bool_),
        driver=driver,
        driver_output=driver_output,
    )
