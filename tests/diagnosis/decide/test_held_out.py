"""Held-out data, confidence intervals, reasons of rivals, on plain numbers."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pam_envs.diagnosis.cause import Cause, Form, Term
from pam_envs.diagnosis.decide.held_out import LEAST_BLOCKS, Choice, HeldOut, choose
from pam_envs.diagnosis.decide.rule import Rule
from pam_envs.diagnosis.decide.verdict import Decision
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate
from pam_envs.diagnosis.fit.intervals import span
from pam_envs.diagnosis.fit.least_squares import Fit, Free
from pam_envs.diagnosis.report.summary_causes import EXCLUDED, reasons

PERIOD = 0.05


def recording(*labels: str, seconds: float = 20.0) -> Any:
    """Return the parts of a recording that are used: a sine in each segment."""
    n = round(seconds / PERIOD)
    time = np.arange(n * len(labels)) * PERIOD
    command = 2e5 * (1.0 + np.sin(time))
    return SimpleNamespace(
        segments=labels, segment=np.repeat(np.arange(len(labels)), n), command=command, time=time
    )


def blocks_of(record: Any) -> Blocks:
    return Blocks.make(record.time, np.zeros((1, len(record.time))))


def test_whole_kinds_are_held_out():
    record = recording("sine_a", "steps", "sine_b", "ramp", "holds")
    choice = choose(record, blocks_of(record))
    assert choice.by == "kinds"
    assert set(choice.kinds) < {"sine", "steps", "ramp", "holds"}
    for k, label in enumerate(record.segments):
        left = choice.rows[record.segment == k]
        assert left.all() == left.any() == (label.split("_")[0] in choice.kinds)
    assert 0.15 <= choice.rows.mean() <= 0.4


@pytest.mark.parametrize("labels", [("a",), ("sine", "steps"), ("run1", "run2", "run3", "run4")])
def test_blocks_are_held_out_with_too_few_kinds(labels):
    record = recording(*labels, seconds=60.0)
    blocks = blocks_of(record)
    choice = choose(record, blocks)
    assert (choice.by, choice.kinds) == ("blocks", ())
    np.testing.assert_array_equal(choice.rows, ~blocks.train)


def held(blocks: int) -> HeldOut:
    """Return held-out data of a number of blocks."""
    rng = np.random.default_rng(3)
    of = np.repeat(np.arange(blocks), 50)
    part = Blocks(of, np.ones(blocks, bool), np.full((1, blocks), 50.0))
    errors = rng.uniform(40.0, 60.0, (2, 1, blocks))
    before, after = (Candidate((), Fit((), np.zeros(0), np.zeros(0)), e) for e in errors)
    choice = Choice(np.ones(len(of), bool), "blocks")
    return HeldOut(choice, None, part, 0, before, after)


def test_gain_interval_needs_enough_blocks():
    many, few = held(LEAST_BLOCKS), held(LEAST_BLOCKS - 1)
    found = many.gain(many.base, many.model)
    low, high = found["interval"]
    assert low < found["value"] < high
    assert few.gain(few.base, few.model)["interval"] is None
    assert many.gain(many.base, many.base) == {"value": 0.0, "interval": [0.0, 0.0]}


def free(log: bool = False) -> Free:
    return Free("muscle.area", 0, 1.0, 1e4, 1.0, log=log)


@pytest.mark.parametrize(
    ("value", "sd", "log", "ends", "at_bound", "not_identified"),
    [
        (100.0, 10.0, False, (80.4, 119.6), False, False),
        (100.0, 5e3, False, (1.0, 9900.0), False, True),
        (1.0, 10.0, False, (None, 20.6), True, False),
        (1e4, 10.0, False, (9980.4, None), True, False),
        (100.0, 0.1, True, (82.2, 121.7), False, False),
        (100.0, 0.7, True, (25.36, 394.3), False, True),
    ],
)
def test_wide_intervals_are_flagged(value, sd, log, ends, at_bound, not_identified):
    found = span(free(log), value, free(log).inner(value), 1.96 * sd)
    for end, expected in zip(found["interval"], ends, strict=True):
        assert end == (None if expected is None else pytest.approx(expected, rel=1e-3))
    assert (found["at_bound"], found["not_identified"]) == (at_bound, not_identified)


def candidate(*names: str) -> Candidate:
    causes = tuple((Cause(n, n, ()), Form("linear", (Term("x", (1.0,)),))) for n in names)
    return Candidate(causes, Fit((), np.zeros(0), np.zeros(0)), np.zeros((1, 1)))


def row(c: Candidate, gain: float, better: float, imitates: bool = False) -> dict[str, Any]:
    forms = [form.name for _, form in c.causes]
    made = {"names": list(c.names), "forms": forms, "gain": gain, "better": better}
    return made | {"imitates": imitates}


def test_reasons_of_rivals_match_the_decision():
    best, close, like, weak, worse = (
        candidate(n) for n in ("leak", "creep", "resonance", "temperature", "wire_slack")
    )
    rows = [
        row(best, 1.0, 1.0),
        row(close, 0.9, 0.3),
        row(like, 1.0, 0.5, imitates=True),
        row(weak, 0.5, 0.3),
        row(worse, 0.9, 0.01),
    ]
    evidence = {"levels": [{"rivals": []}, {"rivals": rows}]}
    rivals = [best, close, like, weak, worse]
    found = reasons(Decision("ambiguous", best, rivals, [close], evidence, 1), Rule())
    assert found == ["the best", "not excluded", "imitates it", "gains less", "surely worse"]
    assert [word in EXCLUDED for word in found] == [False, False, False, True, True]


def test_without_a_named_cause_no_rival_gains_enough():
    rival = candidate("leak")
    evidence = {"levels": [{"rivals": []}, {"rivals": [row(rival, 0.01, 1.0)]}]}
    decision = Decision("adequate", candidate(), [rival], [], evidence)
    assert reasons(decision, Rule()) == ["gains too little"]
