"""A champion as one Python file that needs only NumPy."""

from __future__ import annotations

import inspect
import pprint
from collections.abc import Iterator

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.records.champion import Champion
from exneat_cli.records.exports import standalone
from exneat_cli.records.exports.portable import adapter_of, portable
from exneat_cli.tasks import Task

_WIDTH = 120


def files(champion: Champion, task: Task, evolution: EvolutionSettings) -> dict[str, str]:
    """The file's content; see `exneat_cli.records.exports.exported`."""
    code = inspect.getsource(standalone).removeprefix(f'"""{standalone.__doc__}"""\n')
    code = code.replace("def __init__(self, data):", "def __init__(self, data=DATA):")
    head = [f"# {line}".rstrip() for line in _description(champion, task)]
    imports, _, rest = code.lstrip().partition("\n\n")
    literal = pprint.pformat(portable(champion, task), width=_WIDTH, compact=True, sort_dicts=False)
    return {"": "\n".join([*head, "", imports, "", f"DATA = {literal}", "", rest])}


def _description(champion: Champion, task: Task) -> Iterator[str]:
    """What a reader wants to know, line by line; names have no line breaks in them."""
    test = champion.scores.test
    yield f"A champion of exneat: {champion.variant} on {task.name}."
    yield f"Test {task.fitness_name} {test.fitness_mean:.4g} (sd {test.fitness_std:.3g}, {test.episodes} episodes)."
    yield ""
    yield "    champion = Champion()"
    yield "    champion.reset()                      # when an episode begins"
    yield "    controls = champion.act(observation)  # at every control step"
    yield ""
    yield f"observation, {task.observation_size} numbers, as the simulator gives them:"
    yield from _numbered(adapter_of(task).readings)
    yield ""
    if task.tie_noise:
        yield f"controls, the value of each action; the largest wins, after U(0, {task.tie_noise:g}) is added to each:"
    else:
        yield "controls, in the actuators' own range, in brackets what an action of 1 gives:"
    yield from _numbered(task.actuator_names)


def _numbered(names: tuple[str, ...]) -> Iterator[str]:
    yield from (f"  {entry:>3}  {name}" for entry, name in enumerate(names))
