"""Comparison with ``mujoco.sysid`` on a mass-spring-damper with hidden dry friction.

``python -m benchmarks.head_to_head.run`` runs both tools on the same recordings and prints the
tables; ``--write`` also writes ``docs/head_to_head.md`` and ``results/head_to_head.json.xz``.
Without the extra ``mujoco`` only our diagnosis is run.
"""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from benchmarks.head_to_head import sysid as theirs
from benchmarks.head_to_head.mass_spring_damper import CAUSES, MassSpringDamper
from benchmarks.head_to_head.page import page
from benchmarks.head_to_head.rig import NOISE, PERIOD, Oscillator, another, campaign
from benchmarks.identity.hashing import plain
from benchmarks.runs.provenance import packages
from benchmarks.runs.store import read_json, write_json
from pam_envs.arrays import Array
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.decide.verdict import Decision, decide
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base
from pam_envs.diagnosis.fit.least_squares import Problem, column_of

HERE = Path(__file__).parents[1]
RESULTS = HERE / "results" / "head_to_head.json.xz"
PAGE = HERE.parent / "docs" / "head_to_head.md"
FRICTIONS = (0.0, 0.5, 1.0, 2.0)  # hidden dry friction [N]
OTHERS: dict[str, dict[str, float]] = {
    "dead_time": {"delay": 3},
    "sensor_bias": {"bias": 0.003},
    "sensor_drift": {"drift": 0.006},
}
"""Other hidden effects, to test against a bias towards friction."""
FIRST = 1000  # seed of the first rig; causes and starting values were set on smaller seeds
START = {"mass": 1.5, "stiffness": 70.0, "damping": 3.0}  # starting values of every fit


@dataclasses.dataclass(frozen=True)
class Case:
    """A drawn rig."""

    seed: int
    effect: str  # name of the hidden cause, empty without one
    hidden: dict[str, float]  # hidden constants

    @property
    def rig(self) -> Oscillator:
        """Drawn rig."""
        return Oscillator.drawn(self.seed, **self.hidden)


@dataclasses.dataclass(frozen=True)
class Outcome:
    """A diagnosis of a mass-spring-damper."""

    family: MassSpringDamper
    problem: Problem
    blocks: Blocks
    base: Candidate
    decision: Decision

    def error(self, candidate: Candidate) -> float:
        """Return the RMS residual over the noise on held-out blocks."""
        return float(np.sqrt(self.blocks.means(candidate.errors)[0]))

    def predict(self, candidate: Candidate, force: Array) -> Array:
        """Return the positions of a candidate under another force [m], shape (T,)."""
        family = dataclasses.replace(self.family, force=force)
        return family.simulate(column_of(candidate.fit, candidate.fit.z)[None])[0, :, 0]


def cases(rigs: int, others: int) -> Iterator[Case]:
    """Yield the cases: ``rigs`` for every friction, ``others`` for every other effect."""
    for seed in range(FIRST, FIRST + rigs):
        for friction in FRICTIONS:
            yield Case(seed, "dry_friction" if friction else "", {"friction": friction})
    for seed in range(FIRST, FIRST + others):
        for effect, hidden in OTHERS.items():
            yield Case(seed, effect, hidden)


def diagnose(force: Array, reading: Array) -> Outcome:
    """Diagnose a mass-spring-damper from held forces [N] and position readings [m], (T,)."""
    family = MassSpringDamper(force, PERIOD, START)
    time: Array = np.asarray(np.arange(len(force)) * PERIOD, np.float64)
    measured = reading[None]
    blocks = Blocks.make(time, measured)
    problem = Problem(family.simulate, measured, np.array([NOISE]), blocks.train, time)
    base = fit_base(problem, blocks, family.column, [family.base()])
    position = family.simulate(column_of(base.fit, base.fit.z)[None])[0, :, 0]
    regressors = family.regressors(position)
    decision = decide(problem, family, blocks, base, CAUSES, regressors, Rule())
    return Outcome(family, problem, blocks, base, decision)


def run(case: Case, against: bool, friction: bool = False) -> dict[str, Any]:
    """Return the results of our tool on a case, and of MuJoCo (``against``), in plain types."""
    rig, force, fresh = case.rig, campaign(case.seed), another(case.seed)
    reading, truth = rig.readings(force, case.seed), rig.positions(fresh)
    row = {**dataclasses.asdict(case), "rig": dataclasses.asdict(rig)}
    found = diagnose(force, reading)
    decision, model, blocks = found.decision, found.decision.model, found.blocks
    row["ours"] = {
        "verdict": decision.verdict,
        "causes": list(model.names),
        "forms": [form.name for _, form in model.causes],
        "values": model.fit.values(),
        "base_values": found.base.fit.values(),
        "residual": _rms(found.predict(found.base, force) - reading),
        "held_out": [found.error(found.base), found.error(model)],
        "gain": blocks.gain(found.base.errors, model.errors),
        "rivals": [
            {"causes": list(r.names), "gain": blocks.gain(found.base.errors, r.errors)}
            for r in decision.rivals[:3]
        ],
        "another": [_rms(found.predict(c, fresh) - truth) for c in (found.base, model)],
    }
    runs = {"sysid": against, "sysid_told": against and friction and "friction" in case.hidden}
    for key in (key for key, runs_it in runs.items() if runs_it):
        fit = theirs.identify(force, reading, PERIOD, START, friction=key == "sysid_told")
        row[key] = {
            "values": fit.values,
            "intervals": fit.intervals,
            "issues": fit.issues,
            "residual": _rms(fit.position - reading),
            "another": _rms(theirs.predict(fit.values, fresh, PERIOD) - truth),
        }
    return row


def _rms(values: Array) -> float:
    """Return the RMS of finite values over the noise."""
    return float(np.sqrt(np.nanmean(values**2))) / NOISE


def written() -> dict[str, Any]:
    """Return the stored results."""
    return dict(read_json(RESULTS))


def main(
    rigs: int = 20, others: int = 10, friction: int = 5, write: bool = False
) -> dict[str, Any]:
    """Run both tools on the same recordings and print the tables.

    Args:
        rigs: Drawn rigs for every friction.
        others: Drawn rigs for every other hidden effect.
        friction: Rigs on which MuJoCo also fits friction, which takes most of its time.
        write: Also write ``results/head_to_head.json.xz`` and ``docs/head_to_head.md``.
    """
    from rich.progress import track

    version = theirs.version()
    if version is None:
        print("mujoco.sysid is not installed (pip install -e .[mujoco]): ours alone is run")
    rows = [
        plain(run(case, version is not None, case.seed < FIRST + friction))
        for case in track(list(cases(rigs, others)), "head to head")
    ]
    result = {
        "schema": 1,
        "rule": Rule().version,
        "noise_m": NOISE,
        "packages": packages() | {"mujoco": version},
        "rows": rows,
    }
    text = page(result)
    print(text)
    if write:
        write_json(RESULTS, plain(result))
        PAGE.write_text(text, encoding="utf-8")
    return result


if __name__ == "__main__":
    tyro.cli(main)
