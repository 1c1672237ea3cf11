"""Compiling with numba: without the GIL, cached between processes, never stale.

numba's own cache only invalidates a function when the file that defines it changes; a compiled
episode, however, includes everything that it calls. The cache directory is therefore named after the
contents of all of our files that are compiled together, and functions that call other code, such as
a user's task, are compiled again in each process.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import sys
import time
import types
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numba
from numba.core import config, event
from numba.core.caching import FunctionCache

_COMPILED_ROOMS = ("tasks", "algorithms", "brains", "rollouts")


@functools.cache
def source_digest() -> str:
    """Hexadecimal digest of all of our files that are compiled together, and of NumPy's version."""
    package = Path(__file__).parent
    digest = hashlib.sha256(version("numpy").encode())
    for room in _COMPILED_ROOMS:
        for path in sorted((package / room).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


@functools.cache
def cache_directory() -> Path | None:
    """Where compiled code is cached, or None if nothing can be written there.

    Below ``NUMBA_CACHE_DIR`` if that is set, else ``$XDG_CACHE_HOME/exneat``, else ``~/.cache/exneat``.
    """
    try:
        directory = cache_root() / source_digest()[:16]
        directory.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # RuntimeError: a user without a home directory
        return None
    return directory if os.access(directory, os.W_OK) else None


def cache_root() -> Path:
    """The directory that holds the caches of all versions of the code; see `cache_directory`.

    Raises:
        RuntimeError: no environment variable names it, and the user has no home directory.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "exneat"


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` on its first call: releases the GIL, divides like NumPy, cached if possible."""
    return _compiled(function, _nrt=True)


def compiled_lean(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same for functions that run at every step: they are inlined into their callers, and must not allocate.

    Passing tuples of arrays to a function and counting references to them costs several times as much as a step of a
    grid world. Code that does not allocate can leave out reference counting.
    """
    return _compiled(function, forceinline=True, _nrt=False)


def _compiled(function: Callable[..., Any], **options: Any) -> Callable[..., Any]:
    dispatcher: Any = numba.njit(nogil=True, error_model="numpy", **options)(function)
    directory = cache_directory()
    if directory is not None and _is_all_ours(function):
        # numba has no argument for the cache's directory; this sets its NUMBA_CACHE_DIR for the rest of the process.
        config.CACHE_DIR = str(directory)
        with contextlib.suppress(RuntimeError):  # nothing can be written, although the directory exists
            cache = _Cache(function)
            # On a full disk, numba falls back to another directory, whose name does not depend on what was compiled.
            if directory in Path(cache.cache_path).parents:
                dispatcher._cache = cache
    return dispatcher  # type: ignore[no-any-return]


def _is_all_ours(function: Callable[..., Any]) -> bool:
    """Whether the function, and every compiled one that it calls, is in a file of the digest, see `source_digest`."""
    named: list[Any] = [function.__globals__.get(name) for name in function.__code__.co_names]
    ours = function.__module__.partition(".")[0] == __name__.partition(".")[0]
    return ours and all(_is_all_ours(other.py_func) for other in named if hasattr(other, "py_func"))


@functools.cache
def _tell_damage() -> None:
    """Report a damaged cache once per process."""
    print(f"exneat: a file below {cache_directory()} is damaged: compiling anew", file=sys.stderr, flush=True)


class _Cache(FunctionCache):  # type: ignore[misc]
    """numba's cache of a function, except that a damaged file or a full disk only costs the time to compile."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The cached code for a signature, or None."""
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # unpickling a truncated file may raise anything
            _tell_damage()
            try:
                self.flush()
            except OSError:
                self.disable()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Cache the code compiled for a signature."""
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)


def with_functions(template: Callable[..., Any], name: str, **functions: Callable[..., Any]) -> types.FunctionType:
    """A copy of `template` in which the global names in `functions` refer to those functions.

    This is how one episode loop serves every task: numba caches functions that call compiled globals,
    but not functions that take them as arguments or close over them. `name` must differ between
    copies, since the cache tells them apart by it.
    """
    copy = types.FunctionType(template.__code__, {**template.__globals__, **functions}, name)
    copy.__qualname__ = name
    return copy


class _Compilations(event.Listener):  # type: ignore[misc]
    """Counts this process's compilations; numba calls it under its own lock, for nested compilations too."""

    def __init__(self) -> None:
        self.listeners: list[Callable[[bool], None]] = []
        self.spent, self._depth, self._began = 0.0, 0, 0.0

    def on_start(self, event: Any) -> None:
        """Start to measure, and tell listeners whether the result will be cached."""
        self._depth += 1
        if self._depth == 1:
            self._began = time.perf_counter()
            for tell in tuple(self.listeners):
                tell(isinstance(event.data["dispatcher"]._cache, _Cache))

    def on_end(self, event: Any) -> None:
        """Add the time since the start of the outermost compilation."""
        self._depth -= 1
        if self._depth == 0:
            self.spent += time.perf_counter() - self._began


_compilations = _Compilations()
event.register("numba:compile", _compilations)


def seconds_compiled() -> float:
    """Time that this process has spent on compiling so far (s)."""
    return _compilations.spent


@contextlib.contextmanager
def announcing(tell: Callable[[bool], None]) -> Iterator[None]:
    """Within the block, call `tell` before each compilation, with whether it will be cached for other processes."""
    _compilations.listeners.append(tell)
    try:
        yield
    finally:
        _compilations.listeners.remove(tell)
