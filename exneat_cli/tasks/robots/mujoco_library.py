"""MuJoCo's C functions, callable from compiled code.

`types.ExternalFunction` keeps the symbol's name instead of an address, so code that calls it can be
cached between processes; the symbols become visible once the library that the Python bindings use
is loaded into LLVM as well.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import llvmlite.binding
import mujoco
from numba import types

_ON_MODEL_AND_DATA = types.void(types.int64, types.int64)

mj_step: Any = types.ExternalFunction("mj_step", _ON_MODEL_AND_DATA)
mj_forward: Any = types.ExternalFunction("mj_forward", _ON_MODEL_AND_DATA)
mj_resetData: Any = types.ExternalFunction("mj_resetData", _ON_MODEL_AND_DATA)
mj_rnePostConstraint: Any = types.ExternalFunction("mj_rnePostConstraint", _ON_MODEL_AND_DATA)

_SYMBOLS = ("mj_step", "mj_forward", "mj_resetData", "mj_rnePostConstraint")
_LIBRARY_PATTERNS = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")


def find_library(directory: Path) -> Path | None:
    """MuJoCo's shared library in the bindings' directory, or None."""
    for pattern in _LIBRARY_PATTERNS:
        for path in sorted(directory.glob(pattern)):
            return path
    return None


@functools.cache
def unreachable_because() -> str | None:
    """Why compiled code cannot call MuJoCo here, in words; None if it can."""
    directory = Path(mujoco.__file__).parent
    library = find_library(directory)
    if library is None:
        return f"no MuJoCo library beside its Python bindings in {directory}"
    try:
        llvmlite.binding.load_library_permanently(str(library))
    except RuntimeError as error:
        return f"{library.name} could not be loaded: {error}"
    missing = [name for name in _SYMBOLS if not llvmlite.binding.address_of_symbol(name)]
    if missing:
        return f"{library.name} has no {', '.join(missing)}"
    return None


@functools.cache
def silence_warnings() -> None:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT into the working directory; its counters still count."""
    mujoco.set_mju_user_warning(lambda message: None)
