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

from exneat_cli.errors import ExneatError

_SYMBOLS = ("mj_step", "mj_forward", "mj_resetData", "mj_rnePostConstraint")
_LIBRARY_PATTERNS = ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll")

# Each takes the addresses of an mjModel and an mjData.
_functions: list[Any] = [types.ExternalFunction(name, types.void(types.int64, types.int64)) for name in _SYMBOLS]
mj_step, mj_forward, mj_resetData, mj_rnePostConstraint = _functions


@functools.cache
def load_library() -> None:
    """Let compiled code call MuJoCo.

    Raises:
        ExneatError: its library is not beside its Python bindings, cannot be loaded or lacks a function.
    """
    directory = Path(mujoco.__file__).parent
    libraries = [path for pattern in _LIBRARY_PATTERNS for path in sorted(directory.glob(pattern))]
    fix = "install MuJoCo from its wheel, which holds its library: pip install --force-reinstall mujoco"
    if not libraries:
        raise ExneatError(f"MuJoCo: expected its library in {directory}, got none\n  {fix}")
    try:
        llvmlite.binding.load_library_permanently(str(libraries[0]))
    except RuntimeError as error:
        raise ExneatError(f"MuJoCo: {libraries[0].name} could not be loaded: {error}\n  {fix}") from error
    # Compiled code that calls what is not there would take the process down.
    missing = [name for name in _SYMBOLS if not llvmlite.binding.address_of_symbol(name)]
    if missing:
        raise ExneatError(f"MuJoCo: {libraries[0].name} has no {', '.join(missing)}\n  {fix}")
    # Else MuJoCo would write MUJOCO_LOG.TXT into the working directory; its counters still count.
    mujoco.set_mju_user_warning(lambda message: None)
