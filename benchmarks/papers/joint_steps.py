"""Figures of the joint's step, fluidic_muscles, Fig. 16: with hysteresis, controller beside controller."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.papers.figures import Figure
from benchmarks.papers.joint import BEFORE, SOURCE, UNKNOWN, near

WHERE = f"{SOURCE}, Fig. 16"
BEST = "joint_mfc_mu"
EXPECTED = {
    "joint_pi": 0.165,
    "joint_mfc_mu": 0.132,
    "joint_mfc_mu_plain": 0.171,
    "joint_mfc_mu_wrong": 0.142,
}
"""Rise [s] of a step of 10 degrees, computed beforehand with loops of 10 %."""
OTHERWISE = {"joint_pid": 0.213, "joint_pi_slow": 0.437}
"""The same, of controllers that were tuned by rules that are not known."""
HYSTERESIS = "it depends on the hysteresis, of which only the width of its loops is known"
GAIN = (
    "the hysteresis slows the PI only by the gain after a turn, which is low for a small step and nears"
    " 1 as the step grows; on the first rise there is no turn"
)


def rise_lines() -> list[Figure]:
    """Rise of a step of 10 degrees after a turn, for every controller."""
    from benchmarks.papers.joint_studies import STEPPED, Setting, step

    figures = []
    for name in STEPPED:
        found, first = step(name), step(name, Setting(turned=False))
        text = (
            f"overshoot {found.overshoot:.1f} %, settling {found.settling:.2f} s; the first step"
            f" after the virgin state {first.rise:.3f} s, {first.overshoot:.1f} %"
        )
        title = f"10 deg, rise, {name}"
        if name in EXPECTED:
            figures.append(
                near(title, WHERE, "s", EXPECTED[name], found.rise, note=f"{text}; {BEFORE}",
                     why=HYSTERESIS)
            )  # fmt: skip
            continue
        known = f"; {BEFORE}, tuned otherwise" if name in OTHERWISE else ""
        figures.append(
            Figure(title, WHERE, "s", UNKNOWN, found.rise, None, f"{text}{known}",
                   OTHERWISE.get(name))
        )  # fmt: skip
    return figures


def bound_lines() -> list[Figure]:
    """Bounds on a step of 10 degrees after a turn, on the hysteresis of the studies."""
    from benchmarks.papers.joint_studies import Setting, step

    best, same = step(BEST), step("joint_pi")
    fine = step("joint_pi", Setting(period=1e-3))
    return [
        Figure("rise of a slow PI over MFC + inverse", WHERE, "", UNKNOWN,
               step("joint_pi_slow").rise / best.rise, None, at_least=3.0),
        Figure("overshoot of MFC + inverse above that of the same PI", WHERE, "% points", UNKNOWN,
               best.overshoot - same.overshoot, None, at_most=2.0),
        Figure("rise of the same PI at 1 ms over MFC + inverse at 10 ms", WHERE, "", UNKNOWN,
               fine.rise / best.rise, None,
               f"overshoot {fine.overshoot:.1f} %: the model loop is computed between the samples,"
               " the PI alone is not"),
    ]  # fmt: skip


def ratio_lines() -> list[Figure]:
    """Rise of the same PI over that of model-following, on three plants, by size and turn."""
    from benchmarks.papers.joint_plants import CASES, plant_step

    figures = []
    for plant, size, turned in CASES:
        alone, best = (plant_step(plant, n, size, turned) for n in ("joint_pi", BEST))
        text = (
            f"{alone.rise:.3f} s over {best.rise:.3f} s, overshoot {alone.overshoot:.1f} and"
            f" {best.overshoot:.1f} %"
        )
        when = "after a turn" if turned else "first step"
        title = f"rise of the same PI over MFC + inverse, {plant}, {size:g} deg, {when}"
        figures.append(
            Figure(title, WHERE, "", UNKNOWN, alone.rise / best.rise, None, text, at_least=1.2,
                   why=GAIN)
        )  # fmt: skip
    return figures


GROUPS: tuple[Callable[[], list[Figure]], ...] = (rise_lines, bound_lines, ratio_lines)
