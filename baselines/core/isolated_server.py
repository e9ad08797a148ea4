"""Answers of the process of a controller from outside the package."""

import json
import os
import pickle
import struct
from typing import Any

import numpy as np

from baselines.core import catalogue
from baselines.core.isolated import LONGEST, SHOWN, send


def serve(confined: bool) -> None:
    """Answer requests from the standard input until it ends."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):  # of what a controller prints or reads
        os.dup2(nothing, stream)
    server = Server(confined)
    while size := requests.read(8):
        (length,) = struct.unpack("<Q", requests.read(8 * struct.unpack("<Q", size)[0]))
        try:
            what, *given = pickle.loads(requests.read(length))
            said, arrays = getattr(server, what)(*given)
        except Exception as error:
            text = str(error)[:LONGEST]
            said, arrays = {"error": type(error).__name__, "message": text}, []
        said["arrays"] = [[part.dtype.newbyteorder("<").str, part.shape] for part in arrays]
        little = [part.astype(part.dtype.newbyteorder("<")).tobytes() for part in arrays]
        send(answers, json.dumps(said).encode(), *little)


class Server:
    """Answers of a controller's process."""

    def __init__(self, confined: bool) -> None:
        self.confined, self.state = confined, None
        self.controller: Any = None
        self.names: list[str] = []

    def load(self, folder: str) -> Any:
        """Import the files of a folder."""
        self.names = catalogue.load(folder)
        return {"confined": self.confined}, []

    def list(self) -> Any:
        """Return the descriptions of the folder's entries."""
        about = {n: {k: getattr(catalogue.CONTROLLERS[n], k) for k in SHOWN} for n in self.names}
        return {"entries": json.loads(json.dumps(about, default=dict))}, []

    def make(self, name: str, plant: Any, signals: Any, actions: Any, knobs: Any, seed: int) -> Any:
        """Make a controller."""
        self.controller = catalogue.make_controller(name, plant, signals, actions, seed, knobs)
        return {"models": hasattr(self.controller, "model_output")}, []

    def predict(self, observation: Any, fresh: bool, start: Any, deterministic: bool) -> Any:
        """Return an action and the output of the model that the controller follows."""
        state = None if fresh else self.state
        action, self.state = self.controller.predict(observation, state, start, deterministic)
        output = getattr(self.controller, "model_output", None)
        followed = np.asarray(output(self.state) if output else [], np.float64)
        plain = np.asarray(action)
        if isinstance(action, np.ma.MaskedArray) or plain.dtype.kind not in "biuf":
            raise ValueError(f"action of type {type(action).__name__} is no array of numbers")
        return {}, [plain, followed]
