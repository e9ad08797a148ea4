"""Wall time of a diagnosis: ten minutes at 50 Hz, from the file to the written report."""

import dataclasses
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.rates import Measurement, Missing, median

ROOT = Path(__file__).resolve().parents[2]
SEED, EFFECT, AMPLITUDE = 4_242, "creep", 3.0
CORES = 2
REPORT_S, VERDICT_S = 10.0, 30.0
RUN = """
import sys, time
from pathlib import Path
from pam_envs.data.recording.recording import read_input
from pam_envs.data.rig_file import Rig
from pam_envs.diagnosis import diagnose
folder = Path(sys.argv[1])
rig = Rig.from_yaml(folder / "rig.yaml")
data = read_input(folder / "recording.csv", rig)
diagnose(data, rig=rig, progress=False, closed_loop=False)  # machine code is loaded
start = time.perf_counter()
found = diagnose(data, rig=rig, progress=False, closed_loop=False)
verdict = time.perf_counter()
diagnose(data, rig=rig, progress=False).write(folder / "out")
print(verdict - start, time.perf_counter() - verdict, found.verdict, *found.causes)
"""


def write_case(folder: Path) -> None:
    """Write ``recording.csv`` and ``rig.yaml`` of a rig with creep."""
    from tests.diagnosis import hidden

    rng = np.random.default_rng(SEED)
    base, campaign = hidden.draw_base(rng), hidden.campaign_long(SEED)
    effects = [(hidden.draw_effect(EFFECT, rng), AMPLITUDE)]
    columns = hidden.make_recording(base, effects, campaign, SEED)
    names = list(columns)
    lines = [",".join(names)]
    for row in zip(*columns.values(), strict=True):
        lines.append(",".join(v if isinstance(v, str) else f"{v:.6g}" for v in row))
    (folder / "recording.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    sheet = json.dumps(hidden.rig_yaml(base, campaign), default=float)  # JSON is YAML
    (folder / "rig.yaml").write_text(sheet, encoding="utf-8")


def timed(rounds: int = 3) -> tuple[list[float], list[float], str]:
    """Return wall times [s] of consecutive verdicts and whole reports, and the verdict's text."""
    with tempfile.TemporaryDirectory() as name:
        write_case(Path(name))
        runs = [_timed(Path(name)) for _ in range(rounds)]
    return [run[0] for run in runs], [run[1] for run in runs], runs[-1][2]


def diagnosing(rounds: int) -> list[Measurement]:
    """Time the verdict and the whole report, closed loop and page included."""
    if (os.cpu_count() or 1) < CORES:
        raise Missing(f"this machine has fewer than {CORES} cores")
    verdicts, reports, said = timed(max(1, min(rounds, 3)))
    note = f"10 minutes at 50 Hz, {CORES} threads, wall; it said: {said}"
    limits: dict[str, Any] = {"unit": "s", "better": "less", "note": note}
    whole = Measurement("diagnosis", "whole report", median(reports), **limits)
    return [
        Measurement("diagnosis", "verdict", median(verdicts), floor=VERDICT_S, **limits),
        dataclasses.replace(whole, floor=2 * VERDICT_S, aim=REPORT_S),
    ]


def _timed(folder: Path) -> tuple[float, float, str]:
    """Return the wall times [s] of a verdict and of a whole report, and the verdict's text."""
    threads = {"OMP_NUM_THREADS": str(CORES), "NUMBA_NUM_THREADS": str(CORES)}
    begun = time.perf_counter()
    ran = subprocess.run(
        [sys.executable, "-c", RUN, str(folder)],
        cwd=ROOT,
        env=os.environ | threads,
        capture_output=True,
        text=True,
        check=False,
    )
    if ran.returncode:
        seconds = time.perf_counter() - begun
        raise Missing(f"the diagnosis failed after {seconds:.0f} s: {ran.stderr.strip()[-200:]}")
    verdict, report, said = ran.stdout.split(maxsplit=2)
    return float(verdict), float(report), said.strip()
