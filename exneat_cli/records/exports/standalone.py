"""A champion of exneat in NumPy alone."""

import numpy as np

ACTIVATIONS = {
    "tanh": lambda z: np.tanh(np.clip(2.5 * z, -60.0, 60.0)),
    "sigmoid": lambda z: 1.0 / (1.0 + np.exp(-np.clip(5.0 * z, -60.0, 60.0))),
    "clamped": lambda z: np.clip(z, -1.0, 1.0),
    "relu": lambda z: np.maximum(z, 0.0),
    "identity": lambda z: z,
}

REAL = ("hinge", "above", "axes", "moves", "handedness", "vector_sign", "sign")


class Champion:
    """Networks, what they sense and what they drive.

    Call `reset` when an episode begins, then `act` once per control step: networks may remember.
    """

    def __init__(self, data):
        self.data = data
        frames = data["frames"]
        self.frames = frames and {key: np.array(frames[key], float if key in REAL else int) for key in frames}
        self.layers = []
        for layer in data["layers"]:
            arrays = {key: np.array(layer[key], int) for key in ("slots", "target", "source")}
            arrays |= {key: np.array(layer[key], float) for key in ("bias", "response", "weight")}
            names = np.array(layer["activation"])
            self.layers.append((arrays, [(ACTIVATIONS[name], names == name) for name in np.unique(names)]))
        self.reset()

    def reset(self):
        """Forget everything."""
        self.memory = np.zeros(self.data["size"])

    def act(self, observation):
        """From what the simulator's sensors read, (observation_size,), to its actuators' controls, (actuators,)."""
        data, memory = self.data, self.memory
        readings = np.array(observation, float).reshape(data["observation_size"])
        if data["limits"]:
            readings = np.clip(readings, *data["limits"])
        sensed = self.sense(readings)
        memory[: sensed.size] = sensed
        # Links carry the values of the previous step.
        memory[data["link_slots"]] = memory[data["link_sources"]]
        for layer, activations in self.layers:
            products = memory[layer["source"]] * layer["weight"]
            z = layer["bias"] + layer["response"] * np.bincount(layer["target"], products, layer["slots"].size)
            for activation, chosen in activations:
                z[chosen] = activation(z[chosen])
            memory[layer["slots"]] = z
        action = memory[data["output_slots"]] * data["action_signs"]
        if data["bounded"]:
            action = np.clip(action, -1.0, 1.0)
        return data["middle"] + data["span"] * action

    def sense(self, readings):
        """From readings in the world's axes to what each part senses in its own frame, (sensed,)."""
        frames = self.frames
        if frames is None:
            return readings
        rotation, back = self.rotation(readings), frames["moves"].transpose(0, 2, 1)
        turn = back @ rotation.T  # (frames, 3, 3) from the world's axes to each frame's
        velocity = readings[frames["velocities"]] @ frames["axes"]
        first = frames["spin"]
        spin = readings[first : first + 3] if frames["free"] else frames["hinge"] * readings[first]
        vectors = readings[frames["vector_from"][:, None] + np.arange(3)]
        vectors = np.einsum("vij,vj->vi", turn[frames["vector_frame"]], vectors) * frames["vector_sign"][:, None]
        seen = (
            readings,
            readings[frames["height"]] + frames["above"],
            -turn[:, :, 2],  # direction of gravity
            turn[:, :, 0],  # direction of travel
            turn @ velocity,
            frames["handedness"][:, None] * (back @ spin),  # angular velocity
            vectors,
        )
        return np.concatenate([np.ravel(each) for each in seen])[frames["pick"]] * frames["sign"]

    def rotation(self, readings):
        """(3, 3) from the trunk's axes to the world's."""
        frames = self.frames
        first = frames["orientation"]
        if frames["free"]:
            quaternion = readings[first : first + 4]
            length = np.linalg.norm(quaternion)
            w, x, y, z = quaternion / length if length > 0.0 else (1.0, 0.0, 0.0, 0.0)
        else:
            half = 0.5 * readings[first]
            w, (x, y, z) = np.cos(half), np.sin(half) * frames["hinge"]
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
