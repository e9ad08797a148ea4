"""Controllers for the harness's own tests, built like those of the catalogue."""

import hashlib
import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sweeps.limits import scaled


def wait_at_the_gate() -> None:
    """Wait while there is the file that ``BENCH_FAKES_GATE`` names, within a limit."""
    gate = os.environ.get("BENCH_FAKES_GATE")
    until = time.monotonic() + scaled(120.0)
    while gate and os.path.exists(gate) and time.monotonic() < until:
        time.sleep(0.02)


@dataclass(frozen=True)
class Hold:
    """Always the same normalised action."""

    action: float

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.array([self.action], np.float32), None


@dataclass(frozen=True)
class Inverse:
    """Static inverse of the reference, ``ahead`` preview samples early, plus an integrator."""

    plant: Any
    signals: Any
    action_signals: Any
    ahead: int = 0
    gain: float = 0.0

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        if state is None:
            wait_at_the_gate()
        total = 0.0 if state is None or episode_start else state
        name = f"reference_{self.ahead}" if self.ahead else "reference"
        setpoint = float(self.signals.decode(observation, name))
        load = float(self.signals.decode(observation, "load"))
        seen = float(self.signals.decode(observation, "contraction"))
        total += self.gain * (float(self.signals.decode(observation, "reference")) - seen)
        pressure = 4e7 * (setpoint + total) + 1e4 * load
        return self.action_signals[0].encode([pressure]).astype(np.float32), total


@dataclass(frozen=True)
class Refused:
    """Gives a number that no environment takes, from the first step on."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        return np.array([np.nan], np.float32), None


@dataclass(frozen=True)
class Raises:
    """Works for half a second, then raises."""

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        step = 0 if state is None or episode_start else state
        if step == 50:
            raise KeyError(f"no such thing at {hex(id(self))} of {os.getcwd()}")
        return np.array([0.0], np.float32), step + 1


class Trained:
    """A policy that is a file: weights of load, reference and what has been missed so far."""

    def __init__(self, path, signals, action_signals):
        data = path.read_bytes()
        self.card = json.loads(data)
        self.signals, self.action_signals = signals, action_signals
        self._digest = hashlib.sha256(data).hexdigest()

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        total = 0.0 if state is None or episode_start else state
        setpoint = float(self.signals.decode(observation, "reference"))
        seen = float(self.signals.decode(observation, "contraction"))
        total += self.card["gain"] * (setpoint - seen)
        load = float(self.signals.decode(observation, "load"))
        pressure = self.card["slope"] * (setpoint + total) + 1e4 * load
        return self.action_signals[0].encode([pressure]).astype(np.float32), total

    def digest(self):
        return self._digest


POLICIES: Path | None = None
"""Folder of the policy files, where a test has written some."""


@dataclass(frozen=True)
class Entry:
    """As an entry of the catalogue."""

    summary: str
    knowledge: str = "nothing"
    citation: str = ""
    envs: tuple[str, ...] = ()
    kind: str = "classical"


@dataclass(frozen=True)
class PolicyEntry(Entry):
    """As an entry of a catalogue of policies."""

    def files(self):
        found = sorted(POLICIES.glob("trained.s*.json")) if POLICIES else []
        return {int(path.stem.partition(".s")[2]): path for path in found}


@dataclass(frozen=True)
class TunedEntry(Entry):
    """As an entry with knobs that a search found: beside the policies, in a file that lists them.

    There are none where no test has written some.
    """

    @property
    def found(self):
        file = POLICIES / "tuned.yaml" if POLICIES else None
        if file is None or not file.is_file():
            return {}
        return yaml.safe_load(file.read_text())["tuned"]["tuned"]["knobs"]


CONTROLLERS = {
    "low": Entry("holds 1.5 bar"),
    "middle": Entry("holds 3 bar"),
    "inverse": Entry("static inverse", "nominal model"),
    "ahead": Entry("static inverse, two preview samples early", "nominal model"),
    "integral": Entry("static inverse with an integrator", "nominal model"),
    "tuned": TunedEntry("static inverse with an integrator, tuned", "nominal model"),
    "trained": PolicyEntry("a file", "nominal model", kind="learned"),
    "refused": Entry("not a number"),
    "raises": Entry("raises"),
}


def write_policies(folder, *gains, plant="", **others):
    """Write a policy file for each gain, training seed 0 first; no others are left there."""
    folder.mkdir(exist_ok=True)
    for old in folder.glob("trained.s*.json"):
        old.unlink()
    for seed, gain in enumerate(gains):
        card = {"gain": gain, "slope": 4e7, "plant": plant, "seed": seed, **others}
        card["training"] = {"steps": 1000, "command": f"train --seed {seed}"}
        (folder / f"trained.s{seed}.json").write_text(json.dumps(card))


def write_knobs(folder, **others):
    """Write what searches found: the gain of ``tuned``, and knobs of another controller."""
    found = {"tuned": {"knobs": {"gain": 0.02}}, "other": {"knobs": {"lead": 1.0}}}
    found |= {name: {"knobs": knobs} for name, knobs in others.items()}
    (folder / "tuned.yaml").write_text(yaml.safe_dump({"schema": 1, "tuned": found}))


def make_controller(name, plant=None, signals=None, action_signals=None, training_seed=None):
    """Return a controller by name."""
    parts = (plant, signals, action_signals)
    if name == "trained":
        return Trained(POLICIES / f"trained.s{training_seed}.json", *parts[1:])
    made = {
        "low": lambda: Hold(-0.5),
        "middle": lambda: Hold(0.0),
        "inverse": lambda: Inverse(*parts),
        "ahead": lambda: Inverse(*parts, ahead=2),
        "integral": lambda: Inverse(*parts, gain=0.02),
        "tuned": lambda: Inverse(*parts, gain=CONTROLLERS["tuned"].found["gain"]),
        "raises": Raises,
        "refused": Refused,
    }
    return made[name]()
