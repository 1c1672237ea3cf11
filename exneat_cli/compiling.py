"""Compiling with numba: no GIL, cached between processes, never stale.

numba's own cache forgets a function only when the file that holds it changes; a compiled episode,
however, carries everything that it calls. So the cache directory is named after the contents of
every file that is compiled together.
"""

from __future__ import annotations

import functools
import hashlib
import os
import threading
import types
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numba
from numba import config

_COMPILED_ROOMS = ("tasks", "algorithms", "brains", "rollouts")
_CACHE_SET_UP = threading.Lock()


@functools.cache
def source_digest() -> str:
    """Hexadecimal digest of all files that are compiled together, and of NumPy's version."""
    package = Path(__file__).parent
    digest = hashlib.sha256(version("numpy").encode())
    for room in _COMPILED_ROOMS:
        for path in sorted((package / room).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


@functools.cache
def cache_directory() -> Path | None:
    """Where compiled code is kept, or None where nothing can be written.

    Below ``NUMBA_CACHE_DIR`` if that is set, else ``$XDG_CACHE_HOME/exneat``, else ``~/.cache/exneat``.
    """
    try:
        directory = cache_root() / source_digest()[:16]
        directory.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # RuntimeError: a user without a home directory
        return None
    return directory if os.access(directory, os.W_OK) else None


def cache_root() -> Path:
    """Where caches of all versions of the code lie side by side; see `cache_directory`.

    Raises:
        RuntimeError: nothing is chosen and the user has no home directory.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "exneat"


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` on its first call: releases the GIL, divides like NumPy, cached if possible."""
    return _compiled(function, _nrt=True)


def compiled_lean(function: Callable[..., Any], *, cache: bool = True) -> Callable[..., Any]:
    """The same for what runs at every step: made part of its caller, and allocates nothing.

    Without `cache` it is kept nowhere.

    Passing tuples of arrays to a function and counting references to them costs several times as much as
    what a step of a grid world does. Code that allocates nothing can leave out the counting.
    """
    return _compiled(function, cache=cache, forceinline=True, _nrt=False)


def _compiled(function: Callable[..., Any], *, cache: bool = True, **options: Any) -> Callable[..., Any]:
    directory = cache_directory() if cache else None
    with _CACHE_SET_UP:
        return _compiled_into(directory, function, options)


def _compiled_into(directory: Path | None, function: Callable[..., Any], options: dict[str, Any]) -> Callable[..., Any]:
    before = config.CACHE_DIR  # type: ignore[attr-defined]
    config.CACHE_DIR = "" if directory is None else str(directory)  # type: ignore[attr-defined]
    try:
        try:
            return _decorated(function, options, cache=directory is not None)
        except RuntimeError:  # numba tries to write there; a full disk must cost time only
            return _decorated(function, options, cache=False)
    finally:
        config.CACHE_DIR = before  # type: ignore[attr-defined]


def _decorated(function: Callable[..., Any], options: dict[str, Any], *, cache: bool) -> Callable[..., Any]:
    decorate: Callable[..., Callable[..., Any]] = numba.njit(nogil=True, cache=cache, error_model="numpy", **options)
    return decorate(function)


def with_functions(template: Callable[..., Any], name: str, **functions: Callable[..., Any]) -> types.FunctionType:
    """A copy of `template` in which the global names in `functions` mean those functions.

    This is how one episode loop serves every task: numba caches functions that call compiled globals,
    but not functions that take them as arguments or close over them. `name` must differ between
    copies, since the cache tells them apart by it.
    """
    copy = types.FunctionType(template.__code__, {**template.__globals__, **functions}, name)
    copy.__qualname__ = name
    copy.__module__ = template.__module__
    copy.__doc__ = template.__doc__
    return copy
