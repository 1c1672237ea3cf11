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
def load_library() -> None:
    """Let compiled code call MuJoCo.

    Raises:
        ExneatError: its library is not beside its Python bindings, cannot be loaded or lacks a function.
    """
    directory = Path(mujoco.__file__).parent
    library = find_library(directory)
    fix = "install MuJoCo from its wheel, which holds its library: pip install --force-reinstall mujoco"
    if library is None:
        raise ExneatError(f"MuJoCo: expected its library in {directory}, got none\n  {fix}")
    try:
        llvmlite.binding.load_library_permanently(str(library))
    except RuntimeError as error:
        raise ExneatError(f"MuJoCo: {library.name} could not be loaded: {error}\n  {fix}") from error
    missing = [name for name in _SYMBOLS if not llvmlite.binding.address_of_symbol(name)]
    if missing:
        raise ExneatError(f"MuJoCo: {library.name} has no {', '.join(missing)}\n  {fix}")


@functools.cache
def silence_warnings() -> None:
    """Keep MuJoCo from writing MUJOCO_LOG.TXT into the working directory; its counters still count."""
    mujoco.set_mju_user_warning(lambda message: None)
