"""The classical controllers of the elbow orthosis by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from baselines.core.entry import Entry
from baselines.elbow.allocation import make_elbow_allocation
from baselines.elbow.pid import KNOBS as PID_KNOBS
from baselines.elbow.pid import make_elbow_pid
from baselines.elbow.trivial import make_elbow_random, make_held, make_limp
from baselines.elbow.valves import EARLY_KNOBS, KNOBS
from baselines.knee.catalogue import SIMC
from pam_envs.parameters import Signals
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

ELBOW = ("PAM/ElbowOrthosis-v0",)
SEED_001 = (
    "D. Chakarov, I. Veneva, M. Tsveov, P. Venev, Powered upper limb orthosis actuation system "
    "based on pneumatic artificial muscles, J. Theoretical and Applied Mechanics 48 (2018)"
)
MODEL = "nominal model"

ELBOW_CONTROLLERS: dict[str, Entry] = {
    "elbow_limp": Entry("no pressure, ever; on/off valves let the air out", "nothing", envs=ELBOW),
    "elbow_random": Entry(
        "commands drawn evenly from the whole range, seeded", "nothing", envs=ELBOW
    ),
    "elbow_hold": Entry("3 bar in both bundles always", MODEL, feedback=True, envs=ELBOW),
    "elbow_pid": Entry(
        "PI of the torque as estimated from 1.2 bar in both, SIMC tuning (for on/off valves of a "
        "made-up lag); stiffness as it comes",
        MODEL,
        feedback=True,
        citation=SIMC,
        envs=ELBOW,
        knobs=PID_KNOBS,
    ),
    "elbow_pid_hysteresis": Entry(
        "elbow_pid, with the bundles' friction in its estimate of the torque",
        MODEL,
        feedback=True,
        citation=SIMC,
        envs=ELBOW,
        knobs=PID_KNOBS,
    ),
    "elbow_allocation": Entry(
        "exact allocation of torque and stiffness, loops around both pressures",
        MODEL,
        feedback=True,
        citation=SEED_001,
        envs=ELBOW,
        knobs=KNOBS,
    ),
    "elbow_allocation_hysteresis": Entry(
        "elbow_allocation, with the bundles' friction undone",
        MODEL,
        feedback=True,
        citation=SEED_001,
        envs=ELBOW,
        knobs=KNOBS,
    ),
    "elbow_allocation_early": Entry(
        "elbow_allocation_hysteresis within the pressures of the valves' next step: torque first",
        MODEL,
        feedback=True,
        citation=SEED_001,
        envs=ELBOW,
        knobs=EARLY_KNOBS,
    ),
}

Maker = Callable[..., Any]


def _pid(**how: Any) -> Maker:
    def make(plant: ElbowOrthosis, signals: Signals, actions: Signals, **knobs: Any) -> Any:
        return make_elbow_pid(plant, signals, actions, **how, **knobs)

    return make


def _allocation(**how: Any) -> Maker:
    def make(plant: ElbowOrthosis, signals: Signals, actions: Signals, **knobs: Any) -> Any:
        return make_elbow_allocation(plant, signals, actions, **how, **knobs)

    return make


ELBOW_MAKERS: Mapping[str, Maker] = {
    "elbow_limp": make_limp,
    "elbow_random": make_elbow_random,
    "elbow_hold": make_held,
    "elbow_pid": make_elbow_pid,
    "elbow_pid_hysteresis": _pid(hysteresis=True),
    "elbow_allocation": make_elbow_allocation,
    "elbow_allocation_hysteresis": _allocation(hysteresis=True),
    "elbow_allocation_early": _allocation(hysteresis=True, early=True),
}
"""From nominal plant, signals, action signals and perhaps ``knobs`` to the controller."""
