"""The networks of an exported champion, by neat-python."""

import json
from pathlib import Path

import neat

HERE = Path(__file__).parent


def load(name, directory=HERE):
    """A genome and its configuration, by the name of their two files, e.g. ``genome_0``."""
    kinds = neat.DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation
    config = neat.Config(neat.DefaultGenome, *kinds, str(directory / f"{name}.ini"))
    file = json.loads((directory / f"{name}.json").read_text("utf-8"))
    genome = neat.DefaultGenome(file["id"])
    for each in file["nodes"]:
        gene = genome.nodes[each["id"]] = neat.DefaultGenome.create_node(config.genome_config, each["id"])
        gene.bias, gene.response, gene.activation = each["bias"], each["response"], each["activation"]
    for each in file["connections"]:
        ends = each["from"], each["to"]
        gene = neat.DefaultGenome.create_connection(config.genome_config, *ends, each["innovation"])
        gene.weight, gene.enabled = each["weight"], each["enabled"]
        genome.connections[ends] = gene
    return genome, config


def networks(directory=HERE):
    """A network for each module, by its name; modules.json says what each of them senses and drives."""
    made = {}
    for module in json.loads((directory / "modules.json").read_text("utf-8"))["modules"]:
        genome, config = load(module["genome"], directory)
        kind = neat.nn.FeedForwardNetwork if config.genome_config.feed_forward else neat.nn.RecurrentNetwork
        made[module["name"]] = kind.create(genome, config)
    return made
