"""Held-out data for the reported errors and gains, and the models fitted without them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from pam_envs.arrays import Array, Flags, Indices
from pam_envs.data.recording.recording import Recording
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import (
    Candidate,
    complete_jacobian,
    polish,
    refit,
    restarted,
    without_each_cause,
)
from pam_envs.diagnosis.fit.least_squares import FEW_DAMPINGS, Problem, evaluate, improve, share

SHARE = (0.15, 0.4)  # least and largest share of a record that is held out
LEAST_BLOCKS = 8  # number of held-out blocks that a confidence interval needs
ROUNDS = 3  # rounds of a rival's fit to the training data
DRAWS = 400
LEVEL = (0.025, 0.975)
FADED = 0.02
"""Size below which a shape has faded."""


@dataclass(frozen=True)
class Choice:
    """Choice of the held-out data."""

    rows: Flags  # (T,): held-out samples
    by: str  # {"kinds", "blocks"}: whole kinds of experiment, or interleaved blocks of time
    kinds: tuple[str, ...] = ()  # the held-out kinds; empty for blocks


@dataclass(frozen=True)
class HeldOut:
    """Models fitted to the training samples, with their errors on the held-out samples."""

    choice: Choice
    problem: Problem  # with the other samples for training
    blocks: Blocks  # those with held-out samples
    seed: int  # of the block bootstrap
    base: Candidate
    model: Candidate  # the base with the named causes
    rivals: list[Candidate | None] = field(default_factory=list)  # None: not judged by these data
    without: dict[str, Candidate] = field(default_factory=dict)  # model without each of its causes

    @property
    def rows(self) -> Flags:
        """Held-out samples, shape (T,)."""
        return self.choice.rows

    @cached_property
    def draws(self) -> Indices:
        """Count of each block in the bootstrap samples."""
        return self.blocks.draws(DRAWS, self.seed)

    def interval(self, values: Array) -> list[float] | None:
        """Return the 95 % interval of bootstrap values, or None with too few blocks."""
        if int(self.blocks.held_out.sum()) < LEAST_BLOCKS:
            return None
        return [float(v) for v in np.quantile(values, LEVEL)]

    def gain(self, before: Candidate, after: Candidate) -> dict[str, Any]:
        """Return the gain of one candidate over another with a paired bootstrap interval."""
        gains = self.blocks.gains(before.errors, after.errors, self.draws)
        value = self.blocks.gain(before.errors, after.errors)
        return {"value": value, "interval": self.interval(gains)}


def kind_of(label: str) -> str:
    """Return the kind of experiment of a label: ``random_b`` is of the kind ``random``."""
    return re.sub(r"[\s_.-]+(?:[A-Za-z]|\d+)$|(?<=[A-Za-z])\d+$", "", label) or label


def choose(recording: Recording, blocks: Blocks) -> Choice:
    """Choose the held-out data of a recording.

    Whole kinds of experiment with much but not most of the record, so that a model is judged on
    another kind of motion; the interleaved blocks with fewer than three kinds.
    """
    kinds = [kind_of(label) for label in recording.segments]
    names = sorted(set(kinds))
    of = np.array([names.index(k) for k in kinds])[recording.segment]
    moving = np.bincount(of, np.abs(np.gradient(recording.command)), minlength=len(names)) > 0
    counts = np.bincount(of, minlength=len(names)) / len(of)
    candidates = [k for k in np.argsort(-counts, kind="stable") if moving[k]]
    rows, left = np.zeros(len(of), bool), []
    if len(candidates) < 3:
        return interleaved(blocks)
    for k in candidates[1::2]:  # every second one by length: the longest kind is for training
        if rows.mean() + counts[k] <= SHARE[1]:
            rows |= of == k
            left.append(names[k])
    return Choice(rows, "kinds", tuple(left)) if rows.mean() >= SHARE[0] else interleaved(blocks)


def interleaved(blocks: Blocks) -> Choice:
    """Return the choice of the interleaved blocks on which causes are compared."""
    return Choice(np.asarray(~blocks.train), "blocks")


def compared(
    problem: Problem, blocks: Blocks, base: Candidate, model: Candidate, seed: int = 0
) -> HeldOut:
    """Return base and model of the decision, fitted without the interleaved blocks."""
    part = _held_blocks(problem, blocks, interleaved(blocks).rows)
    return HeldOut(interleaved(blocks), problem, part, seed, base, model)


def _held_blocks(problem: Problem, blocks: Blocks, rows: Flags) -> Blocks:
    """Return the blocks with their counts of some samples."""
    some, n = np.isfinite(problem.measured) & rows, len(blocks.held_out)
    counts = np.stack([np.bincount(blocks.of, s, minlength=n) for s in some])
    return replace(blocks, held_out=counts.sum(axis=0) > 0, counts=counts.astype(np.float64))


def hold_out(
    problem: Problem,
    blocks: Blocks,
    choice: Choice,
    plain: Candidate,
    base: Candidate,
    model: Candidate,
    rivals: Sequence[Candidate],
    close: Sequence[Candidate] = (),
    seed: int = 0,
) -> HeldOut:
    """Fit all candidates to the training data.

    ``plain`` is the base without the differences that the recording needs. Both start from
    their fits to the decision's samples, all others from the new base with their own
    parameters; model and close rivals also start from their previous fits, and the better fit
    to the training data counts. A rival with a cause that happens once cannot be judged on
    held-out kinds of experiment and is left to the interleaved blocks.
    """
    # shapes that fade, like settling at the start, are seen in their first seconds alone
    fading = (problem.shapes.min(axis=1) < FADED) if len(problem.shapes) else np.zeros(0, bool)
    early = (problem.shapes[fading] > FADED).any(axis=0) if fading.any() else False
    choice = replace(choice, rows=choice.rows & ~np.broadcast_to(early, choice.rows.shape))
    rows, again = choice.rows, replace(problem, train=~choice.rows)
    part = _held_blocks(problem, blocks, rows)
    first = refit(again, blocks, plain, before=problem)
    old = _thoroughly(problem, again, blocks, first, base) if base.causes else first
    new = old if model is base else _thoroughly(problem, again, blocks, old, model)
    by_kind = choice.by == "kinds"
    found: list[Candidate | None] = [new if r is model else None for r in rivals]
    others = [
        k
        for k, rival in enumerate(rivals)
        if found[k] is None and not (by_kind and any(cause.once for cause, _ in rival.causes))
    ]
    fitted = _side_by_side(again, old, [rivals[k] for k in others])
    for k, candidate in zip(others, fitted, strict=True):
        thorough = any(rivals[k] is c for c in close)
        found[k] = _thoroughly(problem, again, blocks, old, rivals[k]) if thorough else candidate
    less = without_each_cause(again, blocks, first, new) if len(model.causes) > 1 else {}

    def scored(candidate: Candidate) -> Candidate:
        left = np.where(rows, again.rows(candidate.fit.residual), 0.0)
        return replace(candidate, errors=part.errors(left))

    return HeldOut(
        choice,
        again,
        part,
        seed,
        scored(first),
        scored(new),
        [None if c is None else scored(c) for c in found],
        {name: scored(c) for name, c in less.items()},
    )


def _side_by_side(
    problem: Problem, base: Candidate, candidates: Sequence[Candidate]
) -> list[Candidate]:
    """Return candidates refitted with the base's Jacobian for the base's parameters."""
    if not candidates:
        return []
    complete_jacobian(problem, base.fit)
    shared = share(problem, base.fit)
    fits, known = [], dict(zip((f.name for f in base.fit.frees), base.fit.z, strict=True))
    for c in candidates:
        start = [known.get(f.name, z) for f, z in zip(c.fit.frees, c.fit.z, strict=True)]
        leads = [f.name for f in c.fit.frees[: len(known)]] == list(known)
        fits.append(restarted(c.fit, z=np.array(start), shared=shared if leads else None))
    evaluate(problem, fits)
    improve(problem, fits, ROUNDS, 1e-4, FEW_DAMPINGS)
    return [replace(c, fit=fit) for c, fit in zip(candidates, fits, strict=True)]


def _thoroughly(
    before: Problem, problem: Problem, blocks: Blocks, base: Candidate, model: Candidate
) -> Candidate:
    """Return a candidate refitted from its previous optimum or from the base, the better one."""
    there = refit(problem, blocks, model, before=before)
    here = _side_by_side(problem, base, [model])[0]
    if here.fit.cost < there.fit.cost:
        polish(problem, [here.fit])
    return min(there, here, key=lambda c: c.fit.cost)
