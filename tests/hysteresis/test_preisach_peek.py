"""The peek of a Preisach operator equals its step and leaves the state unchanged."""

from __future__ import annotations

import numpy as np

from pam_envs.hysteresis.extrema import preisach_peek, preisach_step
from pam_envs.hysteresis.maxwell_slip import PlayOperator
from pam_envs.hysteresis.preisach import Preisach

PLAYS = PlayOperator((0.05, 0.1, 0.3), (0.2, 0.3, 0.2), 0.3)


def test_peek_equals_step_and_leaves_the_state_unchanged() -> None:
    rng = np.random.default_rng(0)
    for start in ("low", "virgin"):
        operator = Preisach.from_play(PLAYS, -1.0, 1.0, 41, depth=6, start=start)  # type: ignore[arg-type]
        first = operator.initial_state()
        stack, sums = (np.array(a).reshape(6, 1).tolist() for a in (first.stack, first.sums))
        count = [int(first.counts)]
        table = operator.everett.tolist()
        for x in rng.uniform(-1.2, 1.2, 400):
            before = ([list(r) for r in stack], [list(r) for r in sums], list(count))
            told = preisach_peek(float(x), stack, sums, count, 0, table, -1.0, 20.0)
            assert (stack, sums, count) == before
            if rng.uniform() < 0.7:
                got = preisach_step(float(x), stack, sums, count, 0, table, -1.0, 20.0)
                assert told == got
