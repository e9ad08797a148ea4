"""Numbers of the page on joint and arm equal the computed ones."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from joint_figures import REACHED, figures

from benchmarks.papers import joint_loops
from benchmarks.papers import manipulator as papers_manipulator
from benchmarks.papers.joint_hysteresis import verdicts, width_ratio
from benchmarks.papers.joint_plants import CASES, PLANTS, plant_step
from benchmarks.papers.joint_studies import Setting, step
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from tests.test_readme import run_snippets

pytestmark = pytest.mark.xdist_group("seed_002_joint")
PAGE = Path(__file__).parents[3] / "docs" / "joint_and_arm.md"
TEXT = PAGE.read_text()
FLAT = " ".join(TEXT.replace("**", "").split())


def row(first: str) -> list[str]:
    """Return the cells of the table's line that begins so, without the first one."""
    (line,) = re.findall(rf"^\| {re.escape(first)} \|(.*)\|$", TEXT, re.MULTILINE)
    return [cell.strip() for cell in line.split("|")]


def test_snippets_run_and_print_the_verdicts(capsys) -> None:
    names = run_snippets(PAGE)
    said = capsys.readouterr().out
    assert "passes as a symmetric Preisach operator: symmetry 0.010" in said
    assert "fails the symmetry: symmetry 0.323" in said
    assert "37.12 and 27.77 degrees" in said
    assert names["pair"].symmetric


def test_verdicts() -> None:
    lines = ("joint, `.paper()`", "joint, `.measured()`", "one DMSP-10 that lifts 100 N")
    for first, found in zip(lines, verdicts().values(), strict=True):
        assert row(first)[:2] == [f"{found.symmetry:.3f}", f"{found.congruency:.3f}"]


def test_loops() -> None:
    for made in joint_loops.table():
        cells = [f"{made.mu:.2f}", *(f"{s:.3f}" for s in made.sensitivity), f"{made.peak:.2f}"]
        found = made.step
        cells += [f"{found.rise:.3f} s", f"{found.overshoot:.1f} %", f"{found.settling:.2f} s"]
        assert row(f"`{made.name}`")[:8] == cells


def test_widths() -> None:
    joints = (AntagonisticJoint.paper(), AntagonisticJoint.measured())
    for size in (10, 15, 20):
        ours = [f"{width_ratio(joint, np.radians(size)):.1f}" for joint in joints]
        assert row(f"{size} degrees") == ours


def test_ratios_and_the_sentence_on_them() -> None:
    found = {}
    for plant, size, turned in CASES:
        pair = [plant_step(plant, n, size, turned).rise for n in ("joint_pi", "joint_mfc_mu")]
        found[plant, size, turned] = pair[0] / pair[1]
    for size in (5, 10, 15, 20):
        for turned, words in ((True, "after a turn"), (False, "first")):
            ours = [f"{found[plant, size, turned]:.2f}" for plant in PLANTS]
            assert row(f"{size} degrees, {words}") == ours
    assert {case for case, value in found.items() if value >= 1.2} == REACHED
    assert f"{min(found.values()):.2f} to {max(found.values()):.2f}" in FLAT
    assert "6 of 24 cases, of the step of 10 degrees 1 of 6" in FLAT
    assert "1.2 is reached at 5 degrees after a turn on all three plants" in FLAT


def test_text_between_the_tables() -> None:
    bare = Setting(width=0.0)
    pair = [step(n, bare).rise for n in ("joint_pi", "joint_mfc_mu")]
    assert f"PI rises in {pair[0]:.3f} s and model-following in {pair[1]:.3f} s" in FLAT
    fine, best = step("joint_pi", Setting(period=1e-3)), step("joint_mfc_mu")
    same = step("joint_pi")
    assert f"overshoots by {fine.overshoot:.1f} instead of {same.overshoot:.1f} %" in FLAT
    assert f"{fine.rise / best.rise:.2f} instead of {same.rise / best.rise:.2f}" in FLAT
    assert f"rises {step('joint_pi_slow').rise / best.rise:.1f} times faster" in FLAT
    assert f"{best.overshoot - same.overshoot:.1f} points more than the same PI" in FLAT


def test_paths_and_held_out() -> None:
    for path in papers_manipulator.PATHS:
        both = papers_manipulator.plans(path)
        peaks = [f"{np.rad2deg(plan.peak):.2f}" for plan in (both.unweighted, both.weighted)]
        growth = f"{100.0 * (both.price - 1.0):.0f} %"
        median = f"{np.median(both.weighted.iterations):.0f}"
        assert row(path.name)[:4] == [*peaks, growth, median]
        assert ("**input**" in row(path.name)[4]) == path.calibrated
    found = papers_manipulator.held_out()
    assert f"{found.paths} freely drawn paths {100 * found.crossed:.1f} % cross" in FLAT
    assert f"medians of {found.iterations:.0f} iterations at most" in FLAT
    leaps = f"on {100 * found.leapt_weighted:.0f} % of them the weighted plan leaps"
    assert leaps in FLAT and f"on {100 * found.leapt:.0f} % the unweighted one" in FLAT


MISSED = {
    "PI: rise": ("PI: rise", "{:.3f} s"),
    "sine of 0.5 Hz, 20 degrees, MFC at 10 ms": (
        "sine of 0.5 Hz, 20 deg, 10 ms, joint_mfc_mu",
        "{:.1f} %",
    ),
    "the same, PI": ("sine of 0.5 Hz, 20 deg, 10 ms, joint_pi", "{:.1f} %"),
    "PI less MFC on that sine": (
        "sine, 10 ms: error of the PI less that of model-following",
        "{:.1f} points",
    ),
    "2 degrees off rejected to 10 %, MFC": ("2 deg off rejected to 10 %, joint_mfc_mu", "{:.2f} s"),
    "rise without inverse": ("10 deg, rise, joint_mfc_mu_plain", "{:.3f} s"),
}
"""Lines of the page's last table: the figure, and how it is written."""


@pytest.mark.parametrize("first", sorted(MISSED))
def test_page_lists_the_missed_figures(first: str) -> None:
    name, form = MISSED[first]
    figure = figures()[name]
    assert figure.verdict == "MISSED"
    assert row(first)[1] == form.format(figure.ours)
