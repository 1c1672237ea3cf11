"""Contacts and constraints that MuJoCo Warp orders by chance, or computes differently, corrected between its stages.

MuJoCo Warp appends the contacts of all worlds to one pool, and the rows of a world's constraints to its table, in the
order in which threads arrive. Sums over rows would then vary at random. Both are therefore sorted by what they belong
to, so that a world's results depend on nothing else.
"""

from typing import Any

import mujoco
import warp as wp

wp.set_module_options({"enable_backward": False})

_PYRAMIDAL = wp.constant(int(mujoco.mjtCone.mjCONE_PYRAMIDAL))
_PLANE = wp.constant(int(mujoco.mjtGeom.mjGEOM_PLANE))
_CAPSULE = wp.constant(int(mujoco.mjtGeom.mjGEOM_CAPSULE))


@wp.func
def _aligned(rotation: wp.mat33, frame: wp.mat33):
    """The frame of a contact of a capsule with a plane, turned along the capsule, as in MuJoCo.

    MuJoCo Warp 4.0 does not do so for steep capsules, whose pyramidal friction cones then differ.
    """
    axis = wp.vec3(rotation[0, 2], rotation[1, 2], rotation[2, 2])
    normal = wp.vec3(frame[0, 0], frame[0, 1], frame[0, 2])
    along = axis - normal * wp.dot(normal, axis)
    length = wp.length(along)
    if length <= 1.0e-6:
        return frame
    along = along / length
    return wp.matrix_from_rows(normal, along, wp.cross(normal, along))


@wp.kernel
def list_contacts(
    found: wp.array(dtype=int),
    world_of: wp.array(dtype=int),
    geoms: wp.array(dtype=wp.vec2i),
    kinds: wp.array(dtype=int),
    rotations: wp.array2d(dtype=wp.mat33),
    frames: wp.array(dtype=wp.mat33),
    counts: wp.array(dtype=int),
    listed: wp.array2d(dtype=int),
):
    """Enter each contact of the pool in the list of its world, and correct its frame."""
    c = wp.tid()
    if c >= wp.min(found[0], world_of.shape[0]):
        return
    w = world_of[c]
    k = wp.atomic_add(counts, w, 1)
    if k < listed.shape[1]:
        listed[w, k] = c
    one, other = geoms[c][0], geoms[c][1]
    if one >= 0 and other >= 0:
        if kinds[one] == _PLANE and kinds[other] == _CAPSULE:
            frames[c] = _aligned(rotations[w, other], frames[c])


@wp.func
def _comes_before(geoms: wp.array(dtype=wp.vec2i), number: wp.array(dtype=int), a: int, b: int):
    one, other = geoms[a], geoms[b]
    if one[0] != other[0]:
        return one[0] < other[0]
    if one[1] != other[1]:
        return one[1] < other[1]
    return number[a] < number[b]


@wp.kernel
def sort_contacts(
    geoms: wp.array(dtype=wp.vec2i),
    number: wp.array(dtype=int),
    counts: wp.array(dtype=int),
    listed: wp.array2d(dtype=int),
):
    """Order the list of each world by pairs of geoms, and by their number within a pair."""
    w = wp.tid()
    counts[w] = wp.min(counts[w], listed.shape[1])
    for i in range(1, counts[w]):
        contact = listed[w, i]
        j = int(i)
        while j > 0:
            if not _comes_before(geoms, number, contact, listed[w, j - 1]):
                break
            listed[w, j] = listed[w, j - 1]
            j -= 1
        listed[w, j] = contact


@wp.kernel
def order_rows(
    equalities: wp.array(dtype=int),
    frictions: wp.array(dtype=int),
    limits: wp.array(dtype=int),
    rows: wp.array(dtype=int),
    kind: wp.array2d(dtype=int),
    owner: wp.array2d(dtype=int),
    counts: wp.array(dtype=int),
    listed: wp.array2d(dtype=int),
    dims: wp.array(dtype=int),
    cone: int,
    address: wp.array2d(dtype=int),
    order: wp.array2d(dtype=int),
    moved: wp.array(dtype=int),
):
    """Write the order of each world's rows: by kind and number of what they belong to, then contact by contact."""
    w = wp.tid()
    first_contact = equalities[w] + frictions[w] + limits[w]
    last = wp.min(rows[w], order.shape[1])
    first_contact = wp.min(first_contact, last)
    changed = int(0)
    for i in range(first_contact):
        row = int(i)
        j = int(i)
        while j > 0:
            before = order[w, j - 1]
            earlier = kind[w, before] < kind[w, row] or (
                kind[w, before] == kind[w, row] and owner[w, before] <= owner[w, row]
            )
            if earlier:
                break
            order[w, j] = before
            j -= 1
            changed = 1
        order[w, j] = row
    k = int(first_contact)
    for i in range(counts[w]):
        contact = listed[w, i]
        dim = dims[contact]
        height = dim
        if cone == _PYRAMIDAL and dim > 1:
            height = 2 * (dim - 1)
        if address[contact, 0] >= 0:
            for r in range(height):
                if address[contact, r] >= 0 and k < last:
                    row = address[contact, r]
                    order[w, k] = row
                    address[contact, r] = k
                    if row != k:
                        changed = 1
                    k += 1
    if k != last:  # some rows belong to no known contact: leave all rows where they are
        changed = 0
    moved[w] = changed


@wp.kernel
def set_aside(
    moved: wp.array(dtype=int),
    rows: wp.array(dtype=int),
    order: wp.array2d(dtype=int),
    jacobian: wp.array3d(dtype=float),
    numbers: wp.array3d(dtype=float),
    kind: wp.array2d(dtype=int),
    owner: wp.array2d(dtype=int),
    pos: wp.array2d(dtype=float),
    margin: wp.array2d(dtype=float),
    mass: wp.array2d(dtype=float),
    vel: wp.array2d(dtype=float),
    aref: wp.array2d(dtype=float),
    frictionloss: wp.array2d(dtype=float),
    speed: wp.array2d(dtype=float),
):
    """Copy the rows of worlds whose order changes, in the new order, to `numbers`, (W, rows, nv + 9)."""
    w, k = wp.tid()
    if moved[w] == 0 or k >= wp.min(rows[w], order.shape[1]):
        return
    row = order[w, k]
    nv = numbers.shape[2] - 9
    for i in range(nv):
        numbers[w, k, i] = jacobian[w, row, i]
    numbers[w, k, nv] = float(kind[w, row])
    numbers[w, k, nv + 1] = float(owner[w, row])
    numbers[w, k, nv + 2] = pos[w, row]
    numbers[w, k, nv + 3] = margin[w, row]
    numbers[w, k, nv + 4] = mass[w, row]
    numbers[w, k, nv + 5] = vel[w, row]
    numbers[w, k, nv + 6] = aref[w, row]
    numbers[w, k, nv + 7] = frictionloss[w, row]
    numbers[w, k, nv + 8] = speed[w, row]


@wp.kernel
def put_back(
    moved: wp.array(dtype=int),
    rows: wp.array(dtype=int),
    order: wp.array2d(dtype=int),
    numbers: wp.array3d(dtype=float),
    jacobian: wp.array3d(dtype=float),
    kind: wp.array2d(dtype=int),
    owner: wp.array2d(dtype=int),
    pos: wp.array2d(dtype=float),
    margin: wp.array2d(dtype=float),
    mass: wp.array2d(dtype=float),
    vel: wp.array2d(dtype=float),
    aref: wp.array2d(dtype=float),
    frictionloss: wp.array2d(dtype=float),
    speed: wp.array2d(dtype=float),
):
    """Write back the rows that `set_aside` copied."""
    w, k = wp.tid()
    if moved[w] == 0 or k >= wp.min(rows[w], order.shape[1]):
        return
    nv = numbers.shape[2] - 9
    for i in range(nv):
        jacobian[w, k, i] = numbers[w, k, i]
    kind[w, k] = int(numbers[w, k, nv])
    owner[w, k] = int(numbers[w, k, nv + 1])
    pos[w, k] = numbers[w, k, nv + 2]
    margin[w, k] = numbers[w, k, nv + 3]
    mass[w, k] = numbers[w, k, nv + 4]
    vel[w, k] = numbers[w, k, nv + 5]
    aref[w, k] = numbers[w, k, nv + 6]
    frictionloss[w, k] = numbers[w, k, nv + 7]
    speed[w, k] = numbers[w, k, nv + 8]


@wp.kernel
def add_contact_forces(
    counts: wp.array(dtype=int),
    listed: wp.array2d(dtype=int),
    geoms: wp.array(dtype=wp.vec2i),
    dims: wp.array(dtype=int),
    frames: wp.array(dtype=wp.mat33),
    friction: wp.array(dtype=Any),
    positions: wp.array(dtype=wp.vec3),
    address: wp.array2d(dtype=int),
    cone: int,
    efc_force: wp.array2d(dtype=float),
    body_of: wp.array(dtype=int),
    root_of: wp.array(dtype=int),
    centres: wp.array2d(dtype=wp.vec3),
    force: wp.array2d(dtype=wp.spatial_vector),
):
    """Sum up contact torques and forces on each body about its tree's centre of mass, like MuJoCo's `cfrc_ext`."""
    w = wp.tid()
    for body in range(force.shape[1]):
        force[w, body] = wp.spatial_vector()
    for i in range(counts[w]):
        c = listed[w, i]
        first = address[c, 0]
        if first >= 0:
            dim = dims[c]
            push, twist = wp.vec3(0.0), wp.vec3(0.0)
            if dim == 1:
                push[0] = efc_force[w, first]
            elif cone == _PYRAMIDAL:
                for k in range(dim - 1):
                    up, down = efc_force[w, first + 2 * k], efc_force[w, first + 2 * k + 1]
                    push[0] += up + down
                    across = (up - down) * friction[c][k]
                    if k < 2:
                        push[k + 1] = across
                    else:
                        twist[k - 2] = across
            else:
                for k in range(dim):
                    if k < 3:
                        push[k] = efc_force[w, first + k]
                    else:
                        twist[k - 3] = efc_force[w, first + k]
            turned = wp.transpose(frames[c])
            push = turned * push
            twist = turned * twist
            one, other = body_of[geoms[c][0]], body_of[geoms[c][1]]
            if one > 0:
                arm = positions[c] - centres[w, root_of[one]]
                force[w, one] = force[w, one] - wp.spatial_vector(twist + wp.cross(arm, push), push)
            if other > 0:
                arm = positions[c] - centres[w, root_of[other]]
                force[w, other] = force[w, other] + wp.spatial_vector(twist + wp.cross(arm, push), push)
