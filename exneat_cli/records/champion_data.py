"""What champion.json may hold, checked field by field: it may come from a stranger, and compiled code trusts it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from exneat_cli.algorithms.neat.genes import ACTIVATIONS
from exneat_cli.errors import ConfigError, ExneatError, check_choice, check_flag, check_real, check_whole, shortened
from exneat_cli.records.files import read_json
from exneat_cli.wiring import Module, Pin, Plan

FORMAT = 2
_LARGEST = 1_000_000
_LARGEST_ID = 2**62
_FIELDS = ("format", "variant", "task", "actuators", "feed_forward", "scores", "plan", "genomes")
_MODULE = ("name", "position", "subpopulation", "pins", "outputs", "hidden", "drives")
_SCORES = {
    "training": ("fitness",),
    "validation": ("fitness_mean",),
    "test": ("fitness_mean", "fitness_std", "episodes"),
}


def read_champion_data(path: Path) -> dict[str, Any]:
    """champion.json as plain data whose parts fit together.

    Raises:
        ExneatError: the file is missing or damaged, of another format, or a field is missing, unknown or unusable.
    """
    content = read_json(path)
    kind = content.get("format")
    if kind != FORMAT or isinstance(kind, bool):
        raise ExneatError(f"{path}: expected a champion of format {FORMAT}, got {shortened(kind)}")
    try:
        _check_fields("", content, _FIELDS)
        _check_word("variant", content["variant"])
        _check_words("actuators", content["actuators"])
        check_flag("feed_forward", content["feed_forward"])
        _check_task(content["task"])
        _check_scores(content["scores"])
        _check_plan(content["plan"])
        plan = plan_from_data(content["plan"])
        plan.check()
        if len(content["actuators"]) != plan.action_size:
            raise ValueError(f"names {len(content['actuators'])} actuators for {plan.action_size}")
        _check_genomes(content["genomes"], plan)
    except (ConfigError, ValueError) as error:
        raise ExneatError(f"{path}: damaged: {error}") from error
    return content


def plan_from_data(data: dict[str, Any]) -> Plan:
    """The plan in a champion file, as read from JSON; not checked.

    Raises:
        KeyError, TypeError, ValueError: a field is missing or of the wrong type.
    """
    modules = tuple(
        Module(
            name=module["name"],
            position=(float(module["position"][0]), float(module["position"][1])),
            subpopulation=module["subpopulation"],
            pins=tuple(Pin(**pin) for pin in module["pins"]),
            outputs=module["outputs"],
            hidden=module["hidden"],
            drives=tuple(module["drives"]),
        )
        for module in data["modules"]
    )
    return Plan(modules, int(data["observation_size"]), int(data["action_size"]))


def _check_fields(key: str, value: object, names: Sequence[str]) -> None:
    """Refuse anything but an object with exactly these fields."""
    if not isinstance(value, dict):
        raise ConfigError(key or "the file", f"fields {', '.join(names)}", value)
    for name in names:
        if name not in value:
            raise ValueError(f"{key}{'.' if key else ''}{name} is missing")
    for name in value:
        if name not in names:
            raise ValueError(
                f"{key}{'.' if key else ''}{ascii(name)[1:-1][:60]}: unknown field; known: {', '.join(names)}"
            )


def _check_list(key: str, value: object, low: int = 0) -> Iterable[tuple[str, Any]]:
    if not isinstance(value, list) or not low <= len(value) <= _LARGEST:
        raise ConfigError(key, f"a list of {low} to {_LARGEST} entries", value)
    return ((f"{key}[{k}]", entry) for k, entry in enumerate(value))


def _check_word(key: str, value: object) -> None:
    if not isinstance(value, str) or not value.isprintable() or not 0 < len(value) <= 200:
        raise ConfigError(key, "a word of at most 200 printable characters", value)


def _check_words(key: str, value: object) -> None:
    for place, word in _check_list(key, value):
        _check_word(place, word)


def _check_task(task: object) -> None:
    if not isinstance(task, dict):
        raise ConfigError("task", "the task's parameters", task)
    for name, value in task.items():
        _check_word("task", name)
        if isinstance(value, str):
            _check_word(f"task.{name}", value)
        elif value is not None and not isinstance(value, bool):
            check_real(f"task.{name}", value, -1e300, 1e300)


def _check_scores(scores: object) -> None:
    # Nothing reads the other two: a champion put together by hand may do without them.
    given = tuple(each for each in _SCORES if each == "test" or (isinstance(scores, dict) and each in scores))
    _check_fields("scores", scores, given)
    assert isinstance(scores, dict)
    for section in given:
        figures, needed = scores[section], _SCORES[section]
        if not isinstance(figures, dict) or not set(needed) <= set(figures):
            raise ConfigError(f"scores.{section}", f"figures, at least {', '.join(needed)}", figures)
        for name, figure in figures.items():
            _check_word(f"scores.{section}", name)
            entries = figure if isinstance(figure, list) else [figure]
            for entry in entries:
                check_real(f"scores.{section}.{name}", entry, -1e300, 1e300)
        for name in needed:
            check_real(f"scores.{section}.{name}", figures[name], -1e300, 1e300)


def _check_plan(plan: object) -> None:
    _check_fields("plan", plan, ("modules", "observation_size", "action_size"))
    assert isinstance(plan, dict)
    check_whole("plan.observation_size", plan["observation_size"], 1, _LARGEST)
    check_whole("plan.action_size", plan["action_size"], 1, _LARGEST)
    for key, module in _check_list("plan.modules", plan["modules"], 1):
        _check_fields(key, module, _MODULE)
        _check_word(f"{key}.name", module["name"])
        place = module["position"]
        if not isinstance(place, list) or len(place) != 2:
            raise ConfigError(f"{key}.position", "two numbers", place)
        for coordinate in place:
            check_real(f"{key}.position", coordinate, -1e6, 1e6)
        check_whole(f"{key}.subpopulation", module["subpopulation"], 0, _LARGEST)
        check_whole(f"{key}.outputs", module["outputs"], 1, _LARGEST)
        check_whole(f"{key}.hidden", module["hidden"], 0, _LARGEST)
        for at, actuator in _check_list(f"{key}.drives", module["drives"]):
            check_whole(at, actuator, 0, plan["action_size"] - 1)
        for at, pin in _check_list(f"{key}.pins", module["pins"]):
            _check_pin(at, pin)


def _check_pin(key: str, pin: object) -> None:
    _check_fields(key, pin, ("index", "module", "delayed"))
    assert isinstance(pin, dict)
    check_whole(f"{key}.index", pin["index"], 0, _LARGEST)
    check_whole(f"{key}.module", pin["module"], -1, _LARGEST)
    check_flag(f"{key}.delayed", pin["delayed"])


def _check_genomes(genomes: object, plan: Plan) -> None:
    shapes = plan.subpopulation_shapes
    if not isinstance(genomes, list) or len(genomes) != len(shapes):
        raise ConfigError("genomes", f"{len(shapes)} of them, one for each subpopulation", genomes)
    for k, (genome, (pins, _, outputs)) in enumerate(zip(genomes, shapes, strict=True)):
        key = f"genomes[{k}]"
        _check_fields(key, genome, ("id", "nodes", "connections"))
        check_whole(f"{key}.id", genome["id"], 0, _LARGEST_ID)
        ids = set()
        for at, node in _check_list(f"{key}.nodes", genome["nodes"], 1):
            _check_fields(at, node, ("id", "bias", "response", "activation"))
            check_whole(f"{at}.id", node["id"], 0, _LARGEST_ID)
            check_real(f"{at}.bias", node["bias"], -1e300, 1e300)
            check_real(f"{at}.response", node["response"], -1e300, 1e300)
            check_choice(f"{at}.activation", node["activation"], ACTIVATIONS)
            ids.add(node["id"])
        if len(ids) < len(genome["nodes"]) or not ids.issuperset(range(outputs)):
            raise ValueError(f"{key}.nodes: expected different ids, among them the outputs 0 to {outputs - 1}")
        _check_connections(f"{key}.connections", genome["connections"], ids, pins)


def _check_connections(key: str, connections: object, ids: set[int], pins: int) -> None:
    ends = set()
    for at, gene in _check_list(key, connections):
        _check_fields(at, gene, ("from", "to", "weight", "enabled", "innovation"))
        check_whole(f"{at}.from", gene["from"], -pins, _LARGEST_ID)
        check_whole(f"{at}.to", gene["to"], 0, _LARGEST_ID)
        check_whole(f"{at}.innovation", gene["innovation"], 0, _LARGEST_ID)
        check_real(f"{at}.weight", gene["weight"], -1e300, 1e300)
        check_flag(f"{at}.enabled", gene["enabled"])
        end = gene["from"], gene["to"]
        if gene["to"] not in ids or (gene["from"] >= 0 and gene["from"] not in ids):
            raise ValueError(f"{at}: leads from {end[0]} to {end[1]}, and one of them does not exist")
        if end in ends:
            raise ValueError(f"{at}: a second connection from {end[0]} to {end[1]}")
        ends.add(end)
