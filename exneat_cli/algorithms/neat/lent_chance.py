"""Random numbers for neat-python from a generator that nobody else draws from."""

from __future__ import annotations

import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

import neat.attributes
import neat.genes
import neat.genome
import neat.reproduction

from exneat_cli.interruption import uninterrupted

_DRAWING = (neat.attributes, neat.genes, neat.genome, neat.reproduction)
"""The modules of neat-python 2.0 that draw."""
_GLOBAL = random.random.__self__  # type: ignore[attr-defined]
_LENT = threading.Lock()


@contextmanager
def lent_to_neat(chance: random.Random) -> Iterator[None]:
    """While inside, neat-python draws from `chance` instead of Python's global generator.

    That one belongs to every thread: dask's draw from it whenever they like, also while genomes reproduce.
    One training at a time is let in. Signals are put off, see `uninterrupted`.
    """
    with uninterrupted(), _LENT:
        before = [(module, name, getattr(module, name)) for module, name in drawing_names()]
        try:
            for module, name, drawn in before:
                setattr(module, name, chance if drawn is random else getattr(chance, drawn.__name__))
            yield
        finally:
            for module, name, drawn in before:
                setattr(module, name, drawn)


def drawing_names() -> list[tuple[ModuleType, str]]:
    """The names in neat-python's modules that stand for Python's global generator, or one of its methods."""
    return [(module, name) for module in _DRAWING for name, value in vars(module).items() if draws(value)]


def draws(value: object) -> bool:
    """Whether this is the module `random`, or a function that draws from its global generator."""
    return value is random or getattr(value, "__self__", None) is _GLOBAL
