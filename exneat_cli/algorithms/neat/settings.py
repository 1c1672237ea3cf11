"""Settings of evolution, under neat-python's names; `conf/evolution` lists them, each with a comment."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from exneat_cli.algorithms.neat.genes import ACTIVATIONS
from exneat_cli.errors import ConfigError, check_choice, check_flag, check_real, check_whole

INITIAL_CONNECTIONS = ("full_nodirect", "full_direct", "unconnected", "fs_neat_nohidden", "fs_neat_hidden")
"""neat-python's names; ``fs_neat`` connects one input (Whiteson et al., "Automatic feature selection in
neuroevolution", 2005)."""

_CHOICES = {
    "genome": ("array", "stock"),
    "activation_default": ACTIVATIONS,
    "output_activation": ACTIVATIONS,
    "initial_connection": INITIAL_CONNECTIONS,
    "mutation": ("fixed", "adaptive"),
    "crossover": ("choose", "average"),
    "parent_selection": ("uniform", "rank"),
}
STOCK: dict[str, Any] = {
    "mutation": "fixed",
    "safe_mutation": False,
    "crossover": "choose",
    "crossover_prob": 1.0,
    "parent_selection": "uniform",
}
"""The behaviour of neat-python's own genomes, where array genomes have a choice."""
LEAST_SENSITIVITY = 0.05
"""Minimum, in a pin's unit: without it, weights of an input that is almost always 0 would change too much."""
_AT_LEAST_ONE = ("min_species_size", "max_stagnation")
_SHARES = ("_rate", "_prob", "survival_threshold")
"""Endings of the names of probabilities; other real numbers need only be at least 0."""


@dataclass(frozen=True)
class EvolutionSettings:
    """How genomes start, change and compete; the defaults are those of Ant.

    Names and their meanings are neat-python's (Stanley and Miikkulainen, "Evolving neural networks through
    augmenting topologies", 2002). Rates and shares are probabilities in [0, 1].

    Attributes:
        genome: ``array`` for compiled operators, ``stock`` for neat-python's own genomes, which are slower and draw
            other random numbers.
        feed_forward: whether networks are feed-forward; otherwise they are recurrent.
        activation_default: activation of every node, with neat-python's scaling, e.g. tanh(2.5 x).
        output_activation: activation of outputs, if different; ``clamped`` is x clipped to [-1, 1].
        initial_connection: connections of the first generation.
        neat_hidden, module_hidden: initial hidden nodes of NEAT's network, and of every ExNEAT module.
        positive_start: whether initial weights are abs(N(0, sd)); weights drawn by mutations may still be negative.
        mutation: ``fixed`` power, or ``adaptive``: every genome carries its own weight_mutate_power, which is inherited
            and varied between weight_mutate_power_min and weight_mutate_power_max; bias_mutate_power is scaled with it.
        safe_mutation: whether shifts of a weight that reads a sensor are divided by the root mean square of the
            sensor's values in training so far (at least `LEAST_SENSITIVITY`), to which the weight's effect is
            proportional. This is SM-G of Lehman et al., "Safe mutations for deep and recurrent neural networks
            through output gradients", GECCO 2018: the gradient of a linear output by a weight is the weight's input.
        weight_*, bias_*: initial values are N(0, init_stdev); a mutation adds N(0, mutate_power) with probability
            mutate_rate, or draws anew with probability replace_rate; values stay in [-max_value, max_value].
        enabled_mutate_rate: probability that a mutation draws a connection's enabled flag anew.
        conn_add_prob, conn_delete_prob, node_add_prob, node_delete_prob: probability of each structural mutation.
        crossover: whether a child's matching genes ``choose`` each weight and bias from one of the parents, as in
            neat-python, or take their ``average``: intermediate recombination, by which harmful mutations partly cancel
            out (Beyer and Schwefel, "Evolution strategies", Natural Computing 1, 2002).
        crossover_prob: probability that a child has two parents; 1 in neat-python.
        parent_selection: ``uniform`` among genomes that may have offspring, as in neat-python, or by ``rank``.
        compatibility_disjoint_coefficient, compatibility_weight_coefficient: coefficients of the genetic distance.
        compatibility_threshold: genomes closer than this share a species.
        elitism: number of the best genomes of a species that survive unchanged.
        survival_threshold: share of a species that may have offspring.
        min_species_size: minimum number of genomes of each species.
        max_stagnation: generations without improvement after which a species dies out.
        species_elitism: number of the best species that never stagnate.

    Raises:
        ConfigError: a value is out of range.
    """

    genome: str = "array"
    feed_forward: bool = True
    activation_default: str = "tanh"
    output_activation: str | None = None
    initial_connection: str = "full_nodirect"
    neat_hidden: int = 6
    module_hidden: int = 4
    positive_start: bool = False
    mutation: str = "fixed"
    safe_mutation: bool = False
    weight_init_stdev: float = 0.12
    weight_mutate_power: float = 0.08
    weight_mutate_power_min: float = 0.0
    weight_mutate_power_max: float = 12.0
    weight_mutate_rate: float = 0.8
    weight_replace_rate: float = 0.1
    weight_max_value: float = 12.0
    bias_init_stdev: float = 0.4
    bias_mutate_power: float = 0.2
    bias_mutate_rate: float = 0.7
    bias_replace_rate: float = 0.1
    bias_max_value: float = 12.0
    enabled_mutate_rate: float = 0.01
    conn_add_prob: float = 0.2
    conn_delete_prob: float = 0.1
    node_add_prob: float = 0.1
    node_delete_prob: float = 0.1
    crossover: str = "choose"
    crossover_prob: float = 1.0
    parent_selection: str = "uniform"
    compatibility_disjoint_coefficient: float = 1.0
    compatibility_weight_coefficient: float = 1.25
    compatibility_threshold: float = 3.0
    elitism: int = 2
    survival_threshold: float = 0.2
    min_species_size: int = 2
    max_stagnation: int = 20
    species_elitism: int = 2

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            name, value = field.name, getattr(self, field.name)
            key = f"evolution.{name}"
            if name == "output_activation" and value is None:
                continue
            if name in _CHOICES:
                check_choice(key, value, _CHOICES[name])
            elif isinstance(field.default, bool):
                check_flag(key, value)
            elif name in _AT_LEAST_ONE:
                check_whole(key, value, 1)
            elif isinstance(field.default, int):
                check_whole(key, value, 0, 10_000)
            else:
                check_real(key, value, 0.0, 1.0 if name.endswith(_SHARES) else math.inf)
        self._check_together()

    def _check_together(self) -> None:
        """Refuse settings that only array genomes support, and bounds that exclude the initial mutation power."""
        for name, stock in STOCK.items():
            came = getattr(self, name)
            if self.genome == "stock" and came != stock:
                raise ConfigError(f"evolution.{name}", f"{stock} with genome=stock", came, "use genome=array")
        if self.mutation == "adaptive":
            lowest, highest = self.weight_mutate_power_min, self.weight_mutate_power_max
            if not 0.0 < lowest <= self.weight_mutate_power <= highest:
                expected = "0 < weight_mutate_power_min <= weight_mutate_power <= weight_mutate_power_max"
                powers = f"{lowest:g}, {self.weight_mutate_power:g}, {highest:g}"
                raise ConfigError("evolution.weight_mutate_power", expected, powers, "for mutation=adaptive")


RECURRENT = EvolutionSettings(
    feed_forward=False,
    activation_default="relu",
    initial_connection="full_direct",
    neat_hidden=0,
    module_hidden=0,
    positive_start=True,
    weight_init_stdev=1.0,
    weight_mutate_power=0.5,
    weight_max_value=30.0,
    bias_init_stdev=0.0,
    bias_mutate_power=0.0,
    bias_mutate_rate=0.0,
    bias_replace_rate=0.0,
    bias_max_value=30.0,
    conn_add_prob=0.25,
    conn_delete_prob=0.25,
    node_add_prob=0.25,
    node_delete_prob=0.25,
    compatibility_disjoint_coefficient=1.1,
    compatibility_weight_coefficient=1.1,
    elitism=10,
    survival_threshold=0.4,
    min_species_size=20,
    species_elitism=1,
)
"""Settings for the grid worlds: recurrent networks without biases, whose weights are positive at the start."""
