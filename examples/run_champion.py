"""Run a champion without exneat: all that is needed is its champion.json and NumPy.

    python examples/run_champion.py outputs/ant/<run>/champion.json

makes Gymnasium's Ant walk for one episode. docs/champion.md explains each field of the file.
"""

import json
import sys

import numpy as np

ACTIVATIONS = {"tanh": lambda z: np.tanh(2.5 * z), "relu": lambda z: max(z, 0), "clamped": lambda z: np.clip(z, -1, 1)}
ACTIVATIONS |= {"sigmoid": lambda z: 1.0 / (1.0 + np.exp(-np.clip(5.0 * z, -60.0, 60.0))), "identity": float}


class Champion:
    """A team of networks, from the content of champion.json; create a new one for every episode."""

    def __init__(self, file):
        self.plan, self.recurrent, self.values = file["plan"], not file["feed_forward"], {}
        genomes = [file["genomes"][module["subpopulation"]] for module in self.plan["modules"]]
        self.nodes = {(m, node["id"]): (node, g["connections"]) for m, g in enumerate(genomes) for node in g["nodes"]}

    def act(self, sensed):
        """One step: from the sensed values to the action, both sequences of numbers."""
        self.sensed, self.before, self.values = sensed, self.values, {}
        action = np.zeros(self.plan["action_size"])
        for m, k in self.nodes:  # the first nodes of a module are its outputs; the others drive nothing
            action[self.plan["modules"][m]["drives"][k : k + 1]] = self.read(m, k, old=False)
        return action

    def read(self, m, k, old):
        """The value of node k of module m, or of its pin -1 - k: now, or with `old` at the end of the last step."""
        if k < 0:
            pin = self.plan["modules"][m]["pins"][-1 - k]
            if pin["module"] < 0:
                return self.sensed[pin["index"]]
            m, k, old = pin["module"], pin["index"], old or pin["delayed"]
        if not old and (m, k) in self.nodes and (m, k) not in self.values:
            node, arcs = self.nodes[m, k]
            fed = [c["weight"] * self.read(m, c["from"], self.recurrent) for c in arcs if c["to"] == k and c["enabled"]]
            z = node["bias"] + node["response"] * sum(fed)
            self.values[m, k] = ACTIVATIONS[node["activation"]](z) if fed or not self.recurrent else 0.0
        return (self.before if old else self.values).get((m, k), 0.0)


def walk(path, steps=1000):
    """Let a champion of task=ant walk for one episode and return its forward reward."""
    import gymnasium

    with open(path, encoding="utf-8") as file:
        champion = Champion(json.load(file))
    ant, forward, over = gymnasium.make("Ant-v5", max_episode_steps=steps), 0.0, False
    observation, _ = ant.reset(seed=0)
    while not over:
        observation, _, fallen, late, terms = ant.step(champion.act(observation))
        forward, over = forward + terms["reward_forward"], fallen or late
    return forward


if __name__ == "__main__":
    print(f"forward reward {walk(sys.argv[1]):.1f}")
