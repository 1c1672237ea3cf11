"""The kernel of `exneat_cli.brains.brain` for many brains side by side, in single precision, by Warp."""

import warp as wp

wp.set_module_options({"enable_backward": False})


@wp.struct
class Programs:
    """Brains as in `exneat_cli.brains.Brains`, laid out in S slots of equal size: each array has a row per slot."""

    size: wp.array2d(dtype=int)
    recurrent: wp.array2d(dtype=int)
    first_node: wp.array2d(dtype=int)
    first_link: wp.array2d(dtype=int)
    node_slot: wp.array2d(dtype=int)
    edge_start: wp.array2d(dtype=int)
    edge_source: wp.array2d(dtype=int)
    edge_weight: wp.array2d(dtype=float)
    bias: wp.array2d(dtype=float)
    response: wp.array2d(dtype=float)
    activation: wp.array2d(dtype=int)
    link_slot: wp.array2d(dtype=int)
    link_source: wp.array2d(dtype=int)
    output_slot: wp.array3d(dtype=int)


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
    programs: Programs,
    slots: wp.array(dtype=int),
    brains: wp.array(dtype=int),
    memory: wp.array2d(dtype=float),
    action: wp.array2d(dtype=float),
):
    """One step of each world's brain, `brains` in `slots`, -1 for none; see `exneat_cli.brains.brain.activate`."""
    w = wp.tid()
    s, b = slots[w], brains[w]
    if b < 0:
        return
    for i in range(programs.first_link[s, b], programs.first_link[s, b + 1]):
        memory[w, programs.link_slot[s, i]] = memory[w, programs.link_source[s, i]]
    first, last = programs.first_node[s, b], programs.first_node[s, b + 1]
    recurrent, scratch = programs.recurrent[s, b] != 0, programs.size[s, b] - first
    for node in range(first, last):
        total = float(0.0)
        for edge in range(programs.edge_start[s, node], programs.edge_start[s, node + 1]):
            total += memory[w, programs.edge_source[s, edge]] * programs.edge_weight[s, edge]
        value = _activation(programs.activation[s, node], programs.bias[s, node] + programs.response[s, node] * total)
        if recurrent:
            memory[w, scratch + node] = value
        else:
            memory[w, programs.node_slot[s, node]] = value
    if recurrent:
        for node in range(first, last):
            memory[w, programs.node_slot[s, node]] = memory[w, scratch + node]
    for i in range(action.shape[1]):
        action[w, i] = memory[w, programs.output_slot[s, b, i]]
