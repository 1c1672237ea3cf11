"""Kernels that assign jobs to worlds, disturb readings and record episodes.

A job is one brain in one episode. Its outcome does not depend on the world that does it: noise depends only on the
episode, the step and the reading.
"""

import warp as wp

from exneat_cli.tasks import ENDED, FAILED, RUNNING

wp.set_module_options({"enable_backward": False})

IDLE = -1
"""Status of a world that has no job."""
_RUNNING, _ENDED, _FAILED, _IDLE = wp.constant(RUNNING), wp.constant(ENDED), wp.constant(FAILED), wp.constant(IDLE)
# Constants of Philox.
_MULTIPLY_ONE, _MULTIPLY_TWO = wp.constant(wp.uint64(0xD2511F53)), wp.constant(wp.uint64(0xCD9E8D57))
_ADD_ONE, _ADD_TWO = wp.constant(wp.uint32(0x9E3779B9)), wp.constant(wp.uint32(0xBB67AE85))
_LOW_WORD = wp.constant(wp.uint64(0xFFFFFFFF))


@wp.struct
class Jobs:
    """A queue of jobs, waiting from head to tail: slot, brain, episode and place in the slot's outcomes."""

    head: wp.array(dtype=int)
    tail: wp.array(dtype=int)
    queue: wp.array(dtype=wp.vec4i)


@wp.struct
class Doing:
    """The job of each world: slot, brain in the slot (-1: none), episode and place, with steps and totals so far."""

    slot: wp.array(dtype=int)
    brain: wp.array(dtype=int)
    episode: wp.array(dtype=int)
    place: wp.array(dtype=int)
    steps: wp.array(dtype=int)
    totals: wp.array2d(dtype=wp.float64)


@wp.struct
class Outcome:
    """For each slot and place, status and steps, (S, places), and totals, (S, places, 4).

    `ended`, (S + 1,), counts all episodes of each slot that have ended, and lastly tells whether room was exceeded.
    """

    status: wp.array2d(dtype=int)
    steps: wp.array2d(dtype=int)
    totals: wp.array3d(dtype=wp.float64)
    ended: wp.array(dtype=int)


@wp.kernel
def take_jobs(
    jobs: Jobs,
    doing: Doing,
    status: wp.array(dtype=int),
    begins: wp.array(dtype=int),
    episodes_per_slot: int,
    memory: wp.array2d(dtype=float),
):
    """Give the next job to each world without one; if there is none left, the world rests in row 0 of the starts."""
    w = wp.tid()
    begins[w] = -1
    if status[w] == _RUNNING:
        return
    k = int(-1)
    if jobs.head[0] < jobs.tail[0]:
        k = wp.atomic_add(jobs.head, 0, 1)
        if k >= jobs.tail[0]:
            wp.atomic_sub(jobs.head, 0, 1)
            k = -1
    if k < 0:
        if status[w] != _IDLE:
            status[w] = _IDLE
            doing.brain[w] = -1
            begins[w] = 0
        return
    job = jobs.queue[k % jobs.queue.shape[0]]
    doing.slot[w] = job[0]
    doing.brain[w] = job[1]
    doing.episode[w] = job[0] * episodes_per_slot + job[2]
    doing.place[w] = job[3]
    doing.steps[w] = 0
    for i in range(doing.totals.shape[1]):
        doing.totals[w, i] = wp.float64(0.0)
    for i in range(memory.shape[1]):
        memory[w, i] = 0.0
    begins[w] = 1 + doing.episode[w]
    status[w] = _RUNNING


@wp.func
def _philox(key0: wp.uint32, key1: wp.uint32, step: wp.uint32, block: wp.uint32):
    """Four random words for a key and a counter: Philox 4x32-10 (Salmon et al., "Parallel random numbers: as easy as
    1, 2, 3", 2011).
    """
    a, b, c, d = step, block, wp.uint32(0), wp.uint32(0)
    k, m = key0, key1
    for _ in range(10):
        one = wp.uint64(a) * _MULTIPLY_ONE
        two = wp.uint64(c) * _MULTIPLY_TWO
        a = wp.uint32(two >> wp.uint64(32)) ^ b ^ k
        b = wp.uint32(two & _LOW_WORD)
        c = wp.uint32(one >> wp.uint64(32)) ^ d ^ m
        d = wp.uint32(one & _LOW_WORD)
        k = k + _ADD_ONE
        m = m + _ADD_TWO
    return a, b, c, d


@wp.func
def _normals(first: wp.uint32, second: wp.uint32):
    """Two independent normal numbers from two random words (Box and Muller, 1958)."""
    radius = wp.sqrt(-2.0 * wp.log((float(first >> wp.uint32(8)) + 1.0) * wp.static(2.0**-24)))
    angle = wp.static(2.0 * 3.141592653589793 * 2.0**-24) * float(second >> wp.uint32(8))
    return radius * wp.cos(angle), radius * wp.sin(angle)


@wp.kernel
def disturb(keys: wp.array2d(dtype=wp.uint32), doing: Doing, sd: float, count: int, readings: wp.array2d(dtype=float)):
    """Add normal noise to four readings of one world."""
    w, block = wp.tid()
    if doing.brain[w] < 0:
        return
    episode = doing.episode[w]
    a, b, c, d = _philox(keys[episode, 0], keys[episode, 1], wp.uint32(doing.steps[w]), wp.uint32(block))
    one, two = _normals(a, b)
    three, four = _normals(c, d)
    first = 4 * block
    readings[w, first] += sd * one
    if first + 1 < count:
        readings[w, first + 1] += sd * two
    if first + 2 < count:
        readings[w, first + 2] += sd * three
    if first + 3 < count:
        readings[w, first + 3] += sd * four


@wp.kernel
def keep_count(status: wp.array(dtype=int), terms: wp.array2d(dtype=float), doing: Doing, outcome: Outcome):
    """Add the reward terms of the step, and record the episodes that ended with it."""
    w = wp.tid()
    if doing.brain[w] < 0:
        return
    doing.steps[w] += 1
    for i in range(terms.shape[1]):
        doing.totals[w, i] += wp.float64(terms[w, i])
    if status[w] != _RUNNING:
        slot, place = doing.slot[w], doing.place[w]
        outcome.status[slot, place] = status[w]
        outcome.steps[slot, place] = doing.steps[w]
        for i in range(terms.shape[1]):
            outcome.totals[slot, place, i] = doing.totals[w, i]
        wp.atomic_add(outcome.ended, slot, 1)
