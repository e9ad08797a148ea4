"""Golden trajectory hashes of every environment x hysteresis model.

``python -m tests.envs.golden`` prints those that differ from the committed file; ``--write``
replaces the file, which a change of results needs (and a line under "Changed results").
"""

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym

from tests.envs.cases import COMMON, IDS, OWN, PLAIN, trajectory

FILE = Path(__file__).with_name("golden_trajectories.json")
MODELS = ("maxwell_slip", "preisach", "none")
STEPS, SECONDS, SEED = 120, 1.0, 11
"""Control periods of a trajectory, length of an episode [s] (so that one ends within), and seed."""


def cases() -> dict[str, dict[str, dict[str, Any]]]:
    """Return keyword arguments by environment and variant."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for name in IDS:
        variants = {}
        for model in MODELS:
            for common, arguments in COMMON.items():
                variants[f"{model}/{common}"] = {**arguments, "hysteresis": model}
        found[name] = {**variants, **OWN.get(name, {}), **PLAIN.get(name, {})}
    return found


CASES = cases()


def digest(name: str, variant: str) -> str:
    """Return the hash of one trajectory."""
    env = gym.make(name, episode_seconds=SECONDS, **CASES[name][variant])
    lines = trajectory(env, SEED, STEPS)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def committed() -> dict[str, dict[str, str]]:
    """Return the committed hashes by environment and variant."""
    return json.loads(FILE.read_text())


def main() -> None:
    """Compare with the committed file, or write it."""
    write = "--write" in sys.argv
    old = committed() if FILE.exists() else {}
    new = {name: {v: digest(name, v) for v in variants} for name, variants in CASES.items()}
    for name, variants in new.items():
        for variant, value in variants.items():
            if old.get(name, {}).get(variant) != value:
                print(f"{name} {variant}: {old.get(name, {}).get(variant)} -> {value}")
    if write:
        FILE.write_text(json.dumps(new, indent=1) + "\n")


if __name__ == "__main__":
    main()
