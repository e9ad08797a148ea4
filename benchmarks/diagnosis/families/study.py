"""Study of one case of a family: recording with a hidden effect, diagnosis, and truth."""

import time as clock
from collections.abc import Collection
from typing import Any

from benchmarks.diagnosis.cases import Case, Unmade
from benchmarks.diagnosis.families.cases import BY_NATURE, ground_of, parts_of, start_of
from benchmarks.diagnosis.study import outcome
from benchmarks.identity.hashing import plain
from benchmarks.runs import provenance
from pam_envs.diagnosis.diagnosis import diagnose
from tests.diagnosis.pair_worlds import record as recorded


def study(case: Case, stages: Collection[str] = ("verdict",)) -> dict[str, Any]:
    """Record a rig of a family and diagnose it; return result and truth as plain types."""
    started = clock.perf_counter()
    record: dict[str, Any] = {"schema": 1, "case": case.record(), "failure": None}
    spent = record["volatile"] = provenance.occasion() | {"make_s": 0.0, "runtime_s": None}
    family, world = parts_of(case.world)
    try:
        if case.names:
            ground = ground_of(case.world, case.seed)
            sheet = ground.sheet
            recording, amplitude, size, raw = ground.solved(case.names[0], case.sizes[0])
            truth = {"name": case.names[0], "target": case.sizes[0], "size": size, "raw": raw}
            record["truths"] = [truth | {"amplitude": amplitude}]
        else:
            recording, sheet = recorded(family, world, case.seed)
            record["truths"] = []
        spent["make_s"] = clock.perf_counter() - started
        started = clock.perf_counter()
        found = diagnose(recording, start_of(family), rig=sheet, closed_loop=False, progress=False)
        spent["runtime_s"] = clock.perf_counter() - started
        record |= outcome(found) | {"nature": list(BY_NATURE)}
    except Exception as error:
        record["unmade"] = isinstance(error, Unmade)
        record["failure"] = f"{type(error).__name__}: {error}"
    return dict(plain(record))
