"""Writes in hand are finished before anything ends."""

from __future__ import annotations

import signal
from collections.abc import Iterator

import pytest

from exneat_cli.interruption import Interrupted, finishing, listening
from tests.interruption.processes import in_process


@pytest.fixture(name="listening")
def _listening() -> Iterator[None]:
    with listening():
        yield


@pytest.mark.usefixtures("listening")
def test_a_write_in_hand_is_finished_first() -> None:
    done = []

    def write() -> None:
        with finishing():
            with finishing():
                signal.raise_signal(signal.SIGTERM)
                done.append("inner")
            done.append("outer")
        done.append("never")

    with pytest.raises(Interrupted):
        write()
    assert done == ["inner", "outer"]


def test_a_process_is_not_ended_amid_a_write() -> None:
    done = in_process("""
        from exneat_cli.interruption import watch
        watch.PATIENCE, watch.GRACE = 0.1, 60.0
        try:
            with finishing():
                os.kill(os.getpid(), signal.SIGTERM)
                time.sleep(0.4)
                print("written", flush=True)
        except KeyboardInterrupt:
            time.sleep(60)
    """)
    assert (done.stdout, done.returncode) == ("written\n", 143)


WITH_GENERATORS = """
import random, signal
from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.algorithms.neat.settings import neat_config
from exneat_cli.algorithms.neat.subpopulation import Subpopulation
from exneat_cli.interruption import Interrupted, handlers
from exneat_cli.seeding import stream

settings = EvolutionSettings()
subpopulation = Subpopulation(neat_config(settings, 20, (4, 3, 2)), stream(0, "evolution", 0))
signal.signal(signal.SIGALRM, lambda *_: handlers._hear(signal.SIGALRM, None))
chance, heard = random.Random(0), 0
for generation in range(1500):
    handlers.Heard.forget()
    try:
        signal.setitimer(signal.ITIMER_REAL, chance.uniform(1e-5, 1e-3))
        subpopulation.advance(dict.fromkeys(subpopulation.genomes, 0.0))
        signal.setitimer(signal.ITIMER_REAL, 0)
    except Interrupted:
        heard += 1
print(heard > 100)
"""


def test_signals_while_genomes_reproduce_crash_nothing() -> None:
    done = in_process(WITH_GENERATORS)
    assert (done.stdout, done.stderr, done.returncode) == ("True\n", "", 0)
