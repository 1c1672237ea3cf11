"""A champion as a graph for Graphviz: modules as boxes, sensors, nodes, connections and links."""

from __future__ import annotations

from collections.abc import Iterator

from exneat_cli.algorithms import EvolutionSettings
from exneat_cli.records.champion import Champion
from exneat_cli.tasks import Task

_POSITIVE, _NEGATIVE = "#0072b2", "#d55e00"


def files(champion: Champion, task: Task, evolution: EvolutionSettings) -> dict[str, str]:
    """The file's content; see `exneat_cli.records.exports.exported`."""
    lines = ["digraph champion {", "  rankdir=BT; node [fontsize=9]; edge [fontsize=7, arrowsize=0.5];"]
    used = sorted({entry for module in champion.plan.modules for entry in module.sensors})
    lines += [f"  s{entry} [label={_text(champion.sensors[entry])}, shape=plaintext];" for entry in used]
    for m in range(len(champion.plan.modules)):
        lines += _module(champion, m)
    for m, module in enumerate(champion.plan.modules):
        for k, pin in enumerate(module.pins):
            if not pin.is_sensor and _is_there(champion, pin.module, pin.index):
                style = "dashed" if pin.delayed or not champion.feed_forward else "solid"
                lines.append(f"  m{pin.module}n{pin.index} -> m{m}i{k} [style={style}, color=gray40];")
            elif pin.is_sensor:
                lines.append(f"  s{pin.index} -> m{m}i{k} [color=gray70];")
        for output, actuator in enumerate(module.drives):
            lines.append(f"  a{actuator} [label={_text(champion.actuators[actuator])}, shape=plaintext];")
            lines.append(f"  m{m}n{output} -> a{actuator};")
    return {"": "\n".join([*lines, "}", ""])}


def _module(champion: Champion, m: int) -> Iterator[str]:
    """One box: its pins, its nodes with their functions, and its enabled connections with their weights."""
    module = champion.plan.modules[m]
    genome = champion.genomes[module.subpopulation]
    yield f"  subgraph cluster{m} {{"
    yield f"    label={_text(module.name)};"
    yield from (f"    m{m}i{k} [label={k}, shape=point];" for k in range(len(module.pins)))
    for node in sorted(genome.nodes, key=lambda node: node.id):
        shape = "box" if node.id < module.outputs else "ellipse"
        words = f"{node.activation}\nbias {node.bias!r}" + (
            f"\nresponse {node.response!r}" if node.response != 1 else ""
        )
        yield f"    m{m}n{node.id} [label={_text(words)}, shape={shape}];"
    for gene in genome.connections:
        if gene.enabled:
            source = f"i{-1 - gene.source}" if gene.source < 0 else f"n{gene.source}"
            look = f"label={_text(repr(gene.weight))}, color={_text(_NEGATIVE if gene.weight < 0 else _POSITIVE)}"
            yield f"    m{m}{source} -> m{m}n{gene.target} [{look}];"
    yield "  }"


def _is_there(champion: Champion, module: int, node: int) -> bool:
    """Whether a node that a link reads exists: initial hidden nodes may have been deleted."""
    genome = champion.genomes[champion.plan.modules[module].subpopulation]
    return any(each.id == node for each in genome.nodes)


def _text(words: str) -> str:
    """A quoted text of the DOT language."""
    escaped = words.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
