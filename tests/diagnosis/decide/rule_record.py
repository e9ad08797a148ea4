"""Record of a version of the rule: its numbers, the causes' numbers, and recorded decisions.

``python -m tests.diagnosis.decide.rule_record`` writes the record of the present version.
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.data.recording.recording import Recording
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis.audit.noise import noise_floor
from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.causes import catalogue
from pam_envs.diagnosis.decide.isolability import isolability
from pam_envs.diagnosis.decide.rule import Rule, judge
from pam_envs.diagnosis.decide.structure import Regressors
from pam_envs.diagnosis.decide.verdict import decide
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import fit_base
from pam_envs.diagnosis.fit.least_squares import Free, Problem

Array = NDArray[np.float64]
Json = dict[str, Any]

FOLDER = Path(__file__).with_name("rule_versions")
EVIDENCE = json.loads((FOLDER / "evidence.json").read_text(encoding="utf-8"))
"""Evidence of diagnoses of hidden rigs: two effects, one, a drift-like step, none."""
TIME = np.arange(4500) * 0.02
NAMES = ("gain", "lag", "slope", "offset", "cube", "late")


def numbers_of_rule(rule: Rule) -> Json:
    """Return the numbers of a rule without its version."""
    return {k: v for k, v in dataclasses.asdict(rule).items() if k != "version"}


def numbers_of_cause(cause: Cause) -> Json:
    """Return what a fit and the decision read of a cause."""
    forms = [
        {"name": f.name, "trials": f.trials, "terms": [dataclasses.astuple(t) for t in f.terms]}
        for f in cause.forms
    ]
    return {"forms": forms, **{k: getattr(cause, k) for k in ("contains", "needs", "once")}}


def judgements(rule: Rule) -> Json:
    """Return the judgement of each recorded evidence."""
    return {name: dataclasses.asdict(judge(found, rule)) for name, found in EVIDENCE.items()}


class Line:
    """A plant of two outputs without dynamics, whose causes are a slope, an offset and a bend."""

    channels = ("contraction", "pressure")
    column = np.array([1.0, 3.0, 0.0, 0.0, 0.0, 0.0])

    def simulate(self, columns: Array) -> Array:
        """Return two outputs that decay again and again, shape (2, T, n)."""
        gain, lag, slope, offset, cube, late = columns.T[:, None, :]
        time = TIME[:, None]
        wave = gain * np.exp(-((time + late) % 9.0) / lag)
        return np.stack([wave + slope * time / 90.0 + offset, 3.0 * wave + cube * wave**3])

    def free(self, name: str, **changes: Any) -> Free:
        """Return how a fit moves a parameter."""
        k = NAMES.index(name)
        made = {"low": -1.0, "high": 1.0, "scale": 0.1, "start": float(self.column[k])}
        if k < 2:
            made |= {"low": 0.01, "high": 100.0, "log": True}
        return Free(name, k, **{**made, **changes})


def _cause(name: str, *forms: tuple[str, float], contains: tuple[str, ...] = ()) -> Cause:
    made = tuple(Form(term, (Term(term, (start, -start)),)) for term, start in forms)
    return Cause(name, name, made, contains=contains)


CAUSES = (
    _cause("slope", ("slope", 0.1), contains=("offset",)),
    _cause("offset", ("offset", 0.1)),
    _cause("bend", ("cube", 0.1)),
    _cause("late", ("late", 0.1), ("slope", 0.1)),
)
TRUTHS = {
    "none": [1.2, 2.0, 0.0, 0.0, 0.0, 0.0],
    "offset": [1.2, 2.0, 0.0, 0.12, 0.0, 0.0],
    "slope and bend": [1.2, 2.0, 0.3, 0.0, 0.2, 0.0],
}


def decisions(rule: Rule) -> Json:
    """Return what the engine decides on a plant without dynamics, with its evidence."""
    made, line = {}, Line()
    noise = np.array([0.1, 0.3])
    for name, truth in TRUTHS.items():
        drawn = np.random.default_rng(5).standard_normal((2, len(TIME))) * noise[:, None]
        measured = line.simulate(np.array([truth]))[:, :, 0] + drawn
        blocks = Blocks.make(TIME, measured)
        problem = Problem(line.simulate, measured, noise, blocks.train, TIME)
        frees = (line.free("gain"), line.free("lag"))
        base = fit_base(problem, blocks, line.column, [frees])
        clean = line.simulate(np.array([truth]))[:, :, 0]
        command = 1e5 * clean[1]
        regressors = Regressors.make(
            TIME, command, np.array([clean[0], command]), np.full(len(TIME), 20.0), None
        )
        found = decide(problem, line, blocks, base, CAUSES, regressors, rule)
        alike = isolability(problem, line, base.fit, CAUSES)
        made[name] = {
            "verdict": found.verdict,
            "names": list(found.model.names),
            "evidence": found.evidence,
            "reach": alike.reach.tolist(),
            "cosine": alike.cosine.tolist(),
        }
    return made


def noise_of_a_recording() -> Json:
    """Return the noise floor of holds, repeated, with white and slow noise."""
    rng = np.random.default_rng(3)
    holds = np.repeat([1.0, 3.0, 5.0, 2.0, 4.0], 200)
    command = 1e5 * np.concatenate([holds, holds[::-1], holds])
    slow = np.convolve(rng.standard_normal(len(command) + 99), np.ones(100) / 10.0, "valid")
    contraction = 3e-8 * command + 1e-5 * (rng.standard_normal(len(command)) + slow)
    recording = Recording.from_arrays(
        0.02 * np.arange(len(command)),
        command,
        contraction=contraction,
        load=np.full(len(command), 20.0),
        segment=[label for label in ("a", "b", "c") for _ in holds],
    )
    floors = [noise_floor(recording, Rig(repeats=given)) for given in ((), (("a", "c"),))]
    return {
        source: {"value": floor["contraction"].value, **floor["contraction"].estimates}
        for source, floor in zip(("holds", "repeats"), floors, strict=True)
    }


def record(rule: Rule) -> Json:
    """Return the record of a rule, in plain types."""
    made = {
        "rule": numbers_of_rule(rule),
        "causes": {cause.name: numbers_of_cause(cause) for cause in catalogue()},
        "judgements": judgements(rule),
        "decisions": decisions(rule),
        "noise": noise_of_a_recording(),
    }
    return dict(json.loads(json.dumps(made, default=float)))


def path_of(version: str) -> Path:
    """Return the file of a version's record."""
    return FOLDER / f"{version}.json"


if __name__ == "__main__":
    present = Rule()
    text = json.dumps(record(present), indent=1) + "\n"
    path_of(present.version).write_text(text, encoding="utf-8")
