"""Diagnosis of the orthosis' estimate of the knee torque (yeh2010, Eq. 1).

Eq. 1 computes the knee torque from the vertical ground force, its centre of pressure and the lean
of the shank. :func:`diagnose` compares the estimate with the knee torque of a gait laboratory,
refits the length of the shank, and compares rival terms on held-out strides, with the search and
the decision rule of the muscle diagnosis.

``python -m benchmarks.diagnosis.gait.diagnosis`` prints the results at several paces.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.diagnosis.gait.recording import GaitRecording, record
from benchmarks.diagnosis.plain_plant import Parameters, PlainPlant, plain_causes
from pam_envs.arrays import Array
from pam_envs.constants import GRAVITY
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.decide.structure import Regressors
from pam_envs.diagnosis.decide.verdict import Decision, decide
from pam_envs.diagnosis.fit.blocks import EVERY, Blocks
from pam_envs.diagnosis.fit.candidate import Candidate, fit_base
from pam_envs.diagnosis.fit.least_squares import Problem
from pam_envs.references.gait import NATURAL_STRIDE, PAPER_STRIDE

PARAMETERS: Parameters = {
    "shank.length": (0.43, 0.3, 0.6, 0.01),
    "horizontal.share": (0.0, -3.0, 3.0, 0.1),
    "weight.share": (0.0, -5.0, 5.0, 0.1),
    "inertia.share": (0.0, -5.0, 5.0, 0.1),
    "force.gain": (0.0, -0.9, 2.0, 0.05),
    "sole.shift": (0.0, -0.1, 0.1, 0.005),
    "lean.bias": (0.0, -0.3, 0.3, 0.02),
    "foot.share": (0.0, -2.0, 2.0, 0.1),
    "shoe.delay": (0.0, -0.1, 0.1, 0.01),
    "knee.stiffness": (0.0, -100.0, 100.0, 2.0),
    "knee.damping": (0.0, -20.0, 20.0, 0.5),
    "torque.bias": (0.0, -50.0, 50.0, 1.0),
}


@dataclass(frozen=True)
class GaitEstimate(PlainPlant):
    """Eq. 1 with optional terms for the inputs of a recording, as a diagnosable plant."""

    recording: GaitRecording

    channels = ("torque",)
    units = ("N m",)

    parameters = PARAMETERS
    base_names = ("shank.length",)
    weighed = base_names  # the length is known to 1 cm

    def simulate(self, columns: Array) -> Array:
        """Return the knee torque [N m] for parameters (n, p), shape (1, T, n)."""
        return np.stack([self._torque(column) for column in columns], axis=-1)[None]

    def _torque(self, column: Array) -> Array:
        r, at = self.recording, dict(zip(PARAMETERS, column, strict=True))
        lean = r.lean + at["lean.bias"] + at["foot.share"] * (r.ankle - r.lean)
        arm = at["shank.length"] * np.sin(lean) - r.cop - at["sole.shift"]
        shoe = (1.0 + at["force.gain"]) * r.vertical * arm
        if at["shoe.delay"] != 0.0:
            shoe = np.interp(r.time - at["shoe.delay"], r.time, shoe)
        height = r.leg.ankle_height + at["shank.length"] * np.cos(r.lean)
        weight = r.leg.mass * r.leg.centre * GRAVITY * np.sin(r.lean)
        passive = at["knee.stiffness"] * r.knee + at["knee.damping"] * r.knee_rate
        more = at["inertia.share"] * r.inertial - passive + at["torque.bias"]
        return np.asarray(
            shoe
            - at["horizontal.share"] * r.horizontal * height
            - at["weight.share"] * weight
            + more
        )

    def regressors(self) -> Regressors:
        """Return position and motion of the leg as variables of the residual.

        They come from the markers, whose errors are independent of the estimate; variables from the
        shoe would explain the residual by its own noise.
        """
        r = self.recording
        k, v, a = r.knee / 0.5, r.knee_rate / 3.0, r.ankle / 0.3
        rows = [np.ones_like(k), k, k**2, k**3, v, v**2, v**3, a, a**2, a**3]
        rows += [k * v, k * a, v * a, k**2 * a, k * a**2, v * a**2, np.abs(v)]
        values = {"time": r.time, "pressure": r.vertical}  # the engine's name of the motion
        return Regressors(values, np.array(rows))


CAUSES = plain_causes(
    {
        "horizontal_force": (
            "the horizontal part of the ground's force",
            ("times the knee's height", "horizontal.share", 0.5),
        ),
        "shank_weight": (
            "the weight of shank and foot",
            ("at their centre of mass", "weight.share", 0.5),
        ),
        "inertia": (
            "the acceleration of shank and foot",
            ("below a hip that moves evenly", "inertia.share", 0.5),
        ),
        "force_gain": (
            "load cells that read too much or too little",
            ("in proportion", "force.gain", 0.05),
        ),
        "sole_shift": (
            "a sole that is not where it was measured",
            ("along the foot", "sole.shift", 0.005),
        ),
        "lean_bias": ("a lean that is read from another zero", ("constant", "lean.bias", 0.02)),
        "foot_pitch": (
            "the pitch of the foot, taken to lie flat",
            ("in proportion", "foot.share", 0.2),
        ),
        "delay": ("a shoe and a laboratory of two clocks", ("constant", "shoe.delay", 0.02, -0.02)),
        "passive_knee": (
            "a knee that is stiff or damped by itself",
            ("spring", "knee.stiffness", 2.0),
            ("damper", "knee.damping", 0.5),
        ),
        "torque_bias": (
            "a laboratory whose torque has another zero",
            ("constant", "torque.bias", 1.0),
        ),
    }
)
"""Causes of errors of the estimate or of the recording."""


@dataclass(frozen=True)
class Outcome:
    """Result of a gait diagnosis."""

    recording: GaitRecording
    problem: Problem
    blocks: Blocks
    base: Candidate
    decision: Decision

    @property
    def names(self) -> tuple[str, ...]:
        """Causes of the selected model, in the order of selection."""
        return self.decision.model.names

    @property
    def values(self) -> dict[str, float]:
        """Parameters of the selected model by name [SI]."""
        return self.decision.model.fit.values()

    @property
    def ladder(self) -> list[dict[str, Any]]:
        """Evidence of each level: see :meth:`Ladder.evidence`."""
        return list(self.decision.evidence["levels"])

    def error(self, candidate: Candidate) -> float:
        """Return the RMS error on held-out strides [N m]."""
        mean = self.blocks.means(candidate.errors)[0]
        return float(np.sqrt(mean) * self.problem.noise[0])

    def gain_of(self, name: str) -> float:
        """Return the log mean-square gain of a cause alone on held-out strides; NaN if untested."""
        first = self.ladder[1]["rivals"] if len(self.ladder) > 1 else []
        return next((r["gain"] for r in first if r["names"] == [name]), float("nan"))


def white_noise(values: Array, stride: NDArray[np.int64]) -> float:
    """Return the RMS of the white part of samples, from second differences within strides."""
    second = np.diff(values, 2)
    second = second[(stride[2:] == stride[:-2]) & np.isfinite(second)]
    low, high = np.quantile(second, [0.1587, 0.8413])
    return float(0.5 * (high - low) / np.sqrt(6.0))


def blocks_of(recording: GaitRecording) -> Blocks:
    """Return the strides as blocks, every third one held out."""
    n = int(recording.stride.max()) + 1
    seen = np.isfinite(recording.torque).astype(float)
    counts = np.bincount(recording.stride, seen, minlength=n)[None].astype(np.float64)
    return Blocks(recording.stride, np.arange(n) % EVERY == EVERY - 1, counts)


def diagnose(recording: GaitRecording) -> Outcome:
    """Compare Eq. 1 with the laboratory's knee torque and search for missing terms."""
    family, measured = GaitEstimate(recording), recording.torque[None]
    blocks = blocks_of(recording)
    plain = family.simulate(family.column[None])[0, :, 0]
    noise = np.array([white_noise(recording.torque - plain, recording.stride)])
    problem = Problem(family.simulate, measured, noise, blocks.train, recording.time)
    base = fit_base(problem, blocks, family.column, [family.base()])
    decision = decide(problem, family, blocks, base, CAUSES, family.regressors(), Rule())
    return Outcome(recording, problem, blocks, base, decision)


def main(strides: int = 24, seed: int = 1) -> None:
    """Print the results at several paces, and of walks at two paces."""
    walks = {f"{p:g} s a stride": record(p, strides, seed) for p in PACES}
    slow = record(PAPER_STRIDE, strides // 2, seed + 50)
    for title, walk in list(walks.items())[::2]:
        walks[f"{title} and {PAPER_STRIDE:g} s"] = walk.and_then(slow)
    for title, walk in walks.items():
        found = diagnose(walk)
        shares = {n: v for n, v in found.values.items() if n not in GaitEstimate.base_names}
        terms = ", ".join(f"{name} {value:.2f}" for name, value in shares.items()) or "nothing"
        before, after = (found.error(c) for c in (found.base, found.decision.model))
        print(f"{title}: {found.decision.verdict}; {terms}; {before:.1f} -> {after:.1f} N m")
        for k, level in enumerate(found.ladder[1:], 1):
            gains = [f"{'+'.join(r['names'])} {r['gain']:.2f}" for r in level["rivals"][:4]]
            print(f"  {k}: {'; '.join(gains)}")


PACES = (NATURAL_STRIDE, 2.0, 3.0, PAPER_STRIDE)
"""Durations of a stride [s]; a slow walk is added to every second one."""


if __name__ == "__main__":
    main()
