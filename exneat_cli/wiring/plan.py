"""The wiring plan: the input pins of every module, and what it drives.

A plan is plain data. Modules come in the order of the task's parts, the central module last; pins
come in the order in which genomes see them.
"""

from __future__ import annotations

from dataclasses import dataclass

CENTRAL = "central"
"""Name of the central module."""


@dataclass(frozen=True)
class Pin:
    """One input of a module.

    Attributes:
        index: entry of the sensed values, or node of `module`: outputs from 0, then initial hidden nodes.
        module: index of the module that is read; -1 for a sensor.
        delayed: whether it reads the value of the previous step (0 at the first step), as links do; the central
            module reads its encoders without delay.
    """

    index: int
    module: int = -1
    delayed: bool = False

    @property
    def is_sensor(self) -> bool:
        """Whether it reads a sensed value rather than a module."""
        return self.module < 0


@dataclass(frozen=True)
class Module:
    """One network of the brain, with its wiring.

    Attributes:
        name: the part's name, ``central``, or ``body`` for NEAT's only module.
        position: (x, y) seen from the trunk, x ahead and y to the left.
        subpopulation: the subpopulation from which its genomes come.
        pins: its inputs.
        outputs: number of output nodes.
        hidden: number of initial hidden nodes.
        drives: entries of the action that its outputs set, in their order; empty for an encoder.
    """

    name: str
    position: tuple[float, float]
    subpopulation: int
    pins: tuple[Pin, ...]
    outputs: int
    hidden: int
    drives: tuple[int, ...]

    @property
    def sensors(self) -> tuple[int, ...]:
        """Entries of the sensed values that it reads directly."""
        return tuple(pin.index for pin in self.pins if pin.is_sensor)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of inputs, initial hidden nodes and outputs; equal for modules that share genomes."""
        return len(self.pins), self.hidden, self.outputs


@dataclass(frozen=True)
class Plan:
    """The wiring of a whole brain.

    Attributes:
        modules: part modules in the task's order, then the central module if there is one.
        observation_size: number of sensed values.
        action_size: number of actuators.
    """

    modules: tuple[Module, ...]
    observation_size: int
    action_size: int

    @property
    def subpopulation_shapes(self) -> tuple[tuple[int, int, int], ...]:
        """(inputs, hidden, outputs) of the genomes of each subpopulation."""
        shapes = {module.subpopulation: module.shape for module in self.modules}
        return tuple(shapes[index] for index in range(len(shapes)))

    def check(self) -> None:
        """Refuse a plan that refers to something that does not exist, as one from a damaged file may.

        Raises:
            ValueError: a pin, an actuator or a subpopulation does not exist, an actuator is driven twice, or modules
                that share genomes differ in size.
        """
        subpopulations = {module.subpopulation for module in self.modules}
        if subpopulations != set(range(len(subpopulations))):
            raise ValueError(f"subpopulations are not numbered without gaps: {sorted(subpopulations)}")
        actuators = [actuator for module in self.modules for actuator in module.drives]
        if len(set(actuators)) < len(actuators):
            raise ValueError("two outputs drive the same actuator")
        first_sharer: dict[int, int] = {}
        for m, module in enumerate(self.modules):
            first = first_sharer.setdefault(module.subpopulation, m)
            other = self.modules[first]
            # Compiled brains take a network's size from one of the modules that share its genome; the others must
            # agree.
            if module.shape != other.shape or self.hidden_is_linked(m) != self.hidden_is_linked(first):
                raise ValueError(f"{other.name} and {module.name} share genomes, but not numbers of pins and nodes")
            if not all(0 <= actuator < self.action_size for actuator in module.drives):
                raise ValueError(f"{module.name} drives an actuator that does not exist: {module.drives}")
            if len(module.drives) > module.outputs:
                raise ValueError(f"{module.name} drives more actuators than it has outputs")
            for pin in module.pins:
                if not 0 <= pin.index < self._readable(pin):
                    raise ValueError(f"{module.name} has a pin that reads what does not exist: {pin}")

    def _readable(self, pin: Pin) -> int:
        if pin.is_sensor:
            return self.observation_size
        if pin.module >= len(self.modules):
            return 0
        source = self.modules[pin.module]
        return source.outputs + source.hidden

    def kind_of(self, pin: Pin) -> str:
        """The kind of value that a pin of this plan reads: ``sensor``, ``output`` or ``hidden``."""
        if pin.is_sensor:
            return "sensor"
        return "output" if pin.index < self.modules[pin.module].outputs else "hidden"

    def hidden_is_linked(self, module: int) -> bool:
        """Whether another module reads hidden nodes of `module`."""
        first = self.modules[module].outputs
        return any(pin.module == module and pin.index >= first for m in self.modules for pin in m.pins)
