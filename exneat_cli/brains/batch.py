"""The kernel of `exneat_cli.brains.brain` for many brains in parallel, in single precision, for Warp."""

import numpy as np
import warp as wp
from numpy.typing import NDArray

from exneat_cli.brains.brain import Brains

wp.set_module_options({"enable_backward": False})


FIELDS = Brains._fields[1:]
_SIZE, _RECURRENT, _FIRST_NODE, _FIRST_LINK, _NODE_SLOT, _EDGE_START, _EDGE_SOURCE = map(wp.constant, range(7))
_EDGE_WEIGHT, _BIAS, _RESPONSE, _ACTIVATION, _LINK_SLOT, _LINK_SOURCE, _OUTPUT_SLOT = map(wp.constant, range(7, 14))


def packed(brains: Brains) -> NDArray[np.int32]:
    """All of `brains` as one row of words, to be copied at once: where each of `FIELDS` begins, then the fields.

    Floating-point numbers become the bits of their single-precision values.
    """
    columns = [np.ravel(getattr(brains, name)) for name in FIELDS]
    begins = len(FIELDS) + np.cumsum([0, *map(len, columns)])[:-1]
    words = (each.astype(np.float32).view(np.int32) if each.dtype.kind == "f" else each for each in columns)
    return np.concatenate([begins, *words]).astype(np.int32)


@wp.func
def _activation(code: int, value: float):
    if code == 0:
        return wp.tanh(wp.clamp(2.5 * value, -60.0, 60.0))
    if code == 1:
        return wp.max(value, 0.0)
    if code == 2:
        return 1.0 / (1.0 + wp.exp(-wp.clamp(5.0 * value, -60.0, 60.0)))
    return value


@wp.kernel
def activate(
    programs: wp.array2d(dtype=int),
    slots: wp.array(dtype=int),
    brains: wp.array(dtype=int),
    memory: wp.array2d(dtype=float),
    action: wp.array2d(dtype=float),
):
    """One step of each world's brain, see `exneat_cli.brains.brain.activate`.

    Each slot has a row of `programs`, from `packed`; world w runs brain `brains[w]` (-1: none) of slot `slots[w]`.
    """
    w = wp.tid()
    s, b = slots[w], brains[w]
    if b < 0:
        return
    link_slot, link_source = programs[s, _LINK_SLOT], programs[s, _LINK_SOURCE]
    for i in range(programs[s, programs[s, _FIRST_LINK] + b], programs[s, programs[s, _FIRST_LINK] + b + 1]):
        memory[w, programs[s, link_slot + i]] = memory[w, programs[s, link_source + i]]
    first, last = programs[s, programs[s, _FIRST_NODE] + b], programs[s, programs[s, _FIRST_NODE] + b + 1]
    recurrent = programs[s, programs[s, _RECURRENT] + b] != 0
    scratch = programs[s, programs[s, _SIZE] + b] - first
    start, source, weight = programs[s, _EDGE_START], programs[s, _EDGE_SOURCE], programs[s, _EDGE_WEIGHT]
    slot, bias, response = programs[s, _NODE_SLOT], programs[s, _BIAS], programs[s, _RESPONSE]
    for node in range(first, last):
        total = float(0.0)
        for edge in range(programs[s, start + node], programs[s, start + node + 1]):
            total += memory[w, programs[s, source + edge]] * wp.cast(programs[s, weight + edge], float)
        total = wp.cast(programs[s, bias + node], float) + wp.cast(programs[s, response + node], float) * total
        value = _activation(programs[s, programs[s, _ACTIVATION] + node], total)
        if recurrent:
            memory[w, scratch + node] = value
        else:
            memory[w, programs[s, slot + node]] = value
    if recurrent:
        for node in range(first, last):
            memory[w, programs[s, slot + node]] = memory[w, scratch + node]
    first_output = programs[s, _OUTPUT_SLOT] + b * action.shape[1]
    for i in range(action.shape[1]):
        action[w, i] = memory[w, programs[s, first_output + i]]
