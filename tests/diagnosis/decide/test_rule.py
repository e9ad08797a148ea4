"""Decision rule on plain evidence, kinds of experiment, spectral peaks."""

from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from pam_envs.diagnosis.decide.compare import p_value
from pam_envs.diagnosis.decide.held_out import kind_of
from pam_envs.diagnosis.decide.rule import Rule, judge
from pam_envs.diagnosis.decide.structure import spectral_peak
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.candidate import Candidate
from pam_envs.diagnosis.fit.least_squares import Fit, Problem

RULE = Rule()


def left(
    excess: float = 1.0, r2: float = 0.0, peak: float = 4.0, hertz: float = 5.0
) -> dict[str, Any]:
    found = {"excess": excess, "by_channel": [excess, 0.0], "r2": [r2, 0.0]}
    return found | {"peak": peak, "peaks": [(hertz, peak), (9.0, 3.0)], "rest": 0.0}


def rival(*names: str, gain: float, better: float = 0.0, **marks: bool) -> dict[str, Any]:
    marks = {"imitates": False, "out": False} | marks
    return {"names": list(names), "gain": gain, "better": better, **marks}


def level(gain: float, *rivals: dict[str, Any], added: float | None = None, **more: Any) -> Any:
    made = {"gain": gain, "added": gain if added is None else added, "unsure": 0.0}
    made["possible"] = 9.0
    return {**made, "left": left(), "rivals": list(rivals), **more}


def evidence(*levels: Any, before: dict[str, Any] | None = None) -> dict[str, Any]:
    none = {"gain": 0.0, "added": 0.0, "unsure": 1.0, "rivals": [], "left": before or left()}
    return {"blocks": 25, "levels": [none, *levels]}


LEAK = rival("leak", gain=1.0, better=1.0)
WEAK = rival("leak", gain=0.3, better=1.0)
LIKE = rival("ring", gain=1.0, better=0.5, imitates=True)
BOTH = rival("leak", "creep", gain=1.3, better=1.0)


@pytest.mark.parametrize(
    ("found", "verdict", "names"),
    [
        (evidence(), "adequate", 0),
        (evidence(level(0.04, LEAK)), "adequate", 0),
        (evidence(level(0.4, LEAK, unsure=0.2)), "adequate", 0),
        (evidence(before=left(excess=1.7)), "unexplained", 0),
        (evidence(before=left(r2=0.2)), "unexplained", 0),
        (evidence(before=left(peak=40.0)), "unexplained", 0),
        (evidence(level(1.0, LEAK)), "named", 1),
        (evidence(level(1.0, LEAK, rival("creep", gain=0.9, better=0.2))), "ambiguous", 1),
        (evidence(level(1.0, LEAK, rival("creep", gain=0.9, better=0.01))), "named", 1),
        (evidence(level(1.0, LEAK, rival("creep", gain=0.5, better=0.2))), "named", 1),
        (evidence(level(0.3, WEAK, rival("creep", gain=0.22, better=0.2))), "ambiguous", 1),
        (evidence(level(0.3, WEAK, rival("creep", gain=0.18, better=0.2))), "named", 1),
        (evidence(level(1.0, LEAK, LIKE)), "named", 1),
        (evidence(level(1.0, LEAK, rival("creep", gain=0.9, better=0.2, out=True))), "named", 1),
        (evidence(level(1.0, LEAK), level(1.3, BOTH, added=0.3)), "named", 2),
        (evidence(level(1.0, LEAK), level(1.3, BOTH, added=0.3, unsure=0.1)), "named", 1),
        (evidence(level(1.0, LEAK), level(1.1, BOTH, added=0.1)), "named", 1),
        (evidence(level(3.0, LEAK), level(3.4, BOTH, added=0.4)), "named", 1),
        (evidence(level(3.0, LEAK), level(3.4, BOTH, added=0.4, possible=0.5)), "named", 2),
        (evidence(level(3.0, LEAK), level(3.7, BOTH, added=0.7)), "named", 2),
        (evidence(level(3.0, LEAK), level(3.08, BOTH, added=0.08, possible=0.1)), "named", 1),
        (evidence(level(2.2, LEAK, possible=0.05)), "adequate", 0),
        (evidence(level(2.2, LEAK, possible=0.5)), "named", 1),
    ],
)
def test_verdict_follows_from_evidence(found, verdict, names):
    judged = judge(found, RULE)
    assert (judged.verdict, judged.level) == (verdict, names)


@pytest.mark.parametrize(("blocks", "verdict"), [(25, "named"), (10, "adequate")])
def test_few_blocks_require_a_larger_gain(blocks, verdict):
    found = evidence(level(0.2, LEAK)) | {"blocks": blocks}
    assert judge(found, RULE).verdict == verdict


@pytest.mark.parametrize(
    ("gain", "differs", "verdict"),
    [(0.15, True, "adequate"), (0.15, False, "named"), (0.5, True, "named")],
)
def test_a_rig_that_differs_from_the_base_requires_a_larger_gain(gain, differs, verdict):
    found = evidence(level(gain, LEAK)) | {"differs": differs}
    assert judge(found, RULE).verdict == verdict


FAULT = {
    "name": "unequal_muscles",
    "gain": 2.0,
    "unsure": 0.0,
    "without": {"by_channel": [40.0, 1.0]},
    "left": {"by_channel": [9.0, 1.0]},
    "rival": 0.4,
}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({}, True),
        ({"gain": 0.9, "rival": 0.1}, False),  # as another law may gain
        ({"unsure": 0.2}, False),
        ({"left": {"by_channel": [25.0, 1.0]}}, False),  # less than half of what was missing
        ({"rival": 1.7}, False),  # another cause in its place does as well
    ],
)
@pytest.mark.parametrize("further", [(), (level(0.35, WEAK, left=left(excess=9.0)),)])
def test_a_fault_of_the_base_is_named_incomplete_if_it_explains_much_alone(change, named, further):
    found = evidence(*further, before=left(excess=9.0)) | {"faults": [FAULT | change]}
    judged = judge(found, RULE)
    assert judged.verdict == ("named" if named else "unexplained")
    assert judged.incomplete == named
    assert judged.level == (0 if named or not further else 1)
    assert judge({**found, "faults": []}, RULE).verdict == "unexplained"


def test_a_fault_of_the_base_is_complete_where_nothing_remains():
    judged = judge(evidence() | {"faults": [FAULT]}, RULE)
    assert (judged.verdict, judged.incomplete) == ("adequate", False)


@pytest.mark.parametrize(("added", "number"), [(0.7, 1), (1.2, 2)])
def test_a_further_cause_like_another_law_requires_a_larger_gain(added, number):
    further = level(3.0 + added, BOTH, added=added, lawlike=True)
    assert judge(evidence(level(3.0, LEAK), further), RULE).level == number


@pytest.mark.parametrize(
    ("was", "peak", "hertz", "excess", "verdict"),
    [
        (120.0, 240.0, 5.2, 4.0, "unexplained"),  # the oscillation is still there
        (
            120.0,
            120.0,
            5.2,
            4.0,
            "named",
        ),  # as high over a lower neighbourhood: most of it has gone
        (120.0, 240.0, 3.0, 4.0, "named"),  # another one, of what is left
        (20.0, 60.0, 5.2, 4.0, "named"),  # it was hidden before: not what was to be explained
        (120.0, 50.0, 5.2, 4.0, "named"),  # most of it has gone
        (120.0, 120.0, 5.2, 1.5, "named"),  # little besides
    ],
)
def test_an_oscillation_that_lasts_is_unexplained(was, peak, hertz, excess, verdict):
    after = left(excess=excess, peak=peak, hertz=hertz)
    found = evidence(level(1.0, LEAK, left=after), before=left(excess=10.0, peak=was))
    assert judge(found, RULE).verdict == verdict


@pytest.mark.parametrize(
    ("was", "now", "verdict"),
    [
        (8.0, 7.0, "unexplained"),  # what the pressure does is still unknown
        (8.0, 2.0, "named"),
        (2.5, 2.4, "named"),  # it was nearly known before
    ],
)
def test_a_cause_that_leaves_the_pressure_unexplained_is_not_named(was, now, verdict):
    before, after = left(excess=10.0), left(excess=1.2)
    before["by_channel"], after["by_channel"] = [10.0, was], [1.2, now]
    after["excess"] = max(1.2, now)
    found = evidence(level(2.0, LEAK, left=after), before=before)
    assert judge(found | {"driving": [1]}, RULE).verdict == verdict
    assert judge(found, RULE).verdict == "named"


@pytest.mark.parametrize(
    ("after", "verdict", "incomplete"),
    [(2.0, "named", False), (6.0, "named", True), (7.6, "unexplained", False)],
)
def test_remaining_structure_decides_between_named_and_unexplained(after, verdict, incomplete):
    found = evidence(level(1.0, LEAK, left=left(excess=after)), before=left(excess=10.0))
    judged = judge(found, RULE)
    assert (judged.verdict, judged.incomplete) == (verdict, incomplete)


@pytest.mark.parametrize(
    ("label", "kind"),
    [
        ("staircase", "staircase"),
        ("sine_slow", "sine_slow"),
        ("rest", "rest"),
        ("staircase_a", "staircase"),
        ("random-b", "random"),
        ("steps 3", "steps"),
        ("run12", "run"),
        ("a", "a"),
        ("7", "7"),
    ],
)
def test_label_gives_kind_of_experiment(label, kind):
    assert kind_of(label) == kind


@pytest.mark.parametrize("seconds", [30, 60, 120, 300])
def test_spectrum_of_white_noise_has_no_peak_unlike_that_of_a_hum(seconds):
    period = 0.02
    time = np.arange(round(seconds / period)) * period
    for seed in range(20):
        noise = np.random.default_rng(seed).standard_normal(len(time))
        assert spectral_peak(noise, period)[1] < RULE.peak
    hum = noise + 0.7 * np.sin(2.0 * np.pi * 6.3 * time)
    frequency, height = spectral_peak(hum, period)
    assert frequency == pytest.approx(6.3, abs=0.2)
    assert height > RULE.peak


# --- p-values ------------------------------------------------------------------------------------


def compared(
    change: float, slow: float, seed: int, seconds: int = 300, there: bool = True
) -> float:
    """Return the p-value of a sine that is present or absent in noise with a slow part."""
    rng = np.random.default_rng(seed)
    time = np.arange(seconds * 50) * 0.02
    white, kept = rng.standard_normal((2, len(time))), np.exp(-0.02)
    correlated = lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], white[1])
    noise = np.sqrt(1.0 - slow) * white[0] + np.sqrt(slow) * correlated
    removed = change * np.sqrt(2.0) * np.sin(2.0 * np.pi * 0.1 * time)
    blocks = Blocks.make(time, noise[None])
    problem = Problem(lambda columns: columns, noise[None], np.ones(1), blocks.train, time)

    def model(rows: Any) -> Candidate:
        residual = rows[problem.order]
        return Candidate((), Fit((), np.zeros(0), np.zeros(0), residual=residual), residual)

    before, after = (noise + removed, noise) if there else (noise, noise - removed)
    return p_value(problem, blocks, model(before), model(after), looked=25)


@pytest.mark.parametrize("slow", [0.0, 0.5])
def test_removed_sine_has_a_small_p_value(slow):
    assert compared(1.0, slow, 1) < 1e-3


@pytest.mark.parametrize("slow", [0.0, 0.5])
def test_absent_sine_is_seldom_significant(slow):
    found = [compared(0.1, slow, seed, there=False) for seed in range(60)]
    assert sum(value <= RULE.doubt for value in found) <= 1


def test_longer_data_lower_the_p_value():
    assert compared(0.3, 0.5, 3, seconds=600) < compared(0.3, 0.5, 3, seconds=60)


def test_cause_like_another_law_needs_more_where_the_base_differs() -> None:
    """On a rig of another law a gain of 0.5 names a leak, but not a nonlinear sensor."""
    differs = {"differs": True}
    weak = level(0.5, rival("leak", gain=0.5, better=1.0))
    like = level(0.5, rival("bow", gain=0.5, better=1.0), lawlike=True)
    assert judge(evidence(weak) | differs, RULE).verdict == "named"
    assert judge(evidence(like) | differs, RULE).verdict == "adequate"
    assert judge(evidence(like), RULE).verdict == "named"
