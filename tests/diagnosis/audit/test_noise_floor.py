"""Noise floor of repeats that differ by more than noise."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from pam_envs.data.recording.recording import Recording, Rig
from pam_envs.diagnosis.audit.noise import ChannelFloor, noise_floor
from tests.diagnosis.audit.test_audit import NOISE, RIG, arrays, made

UNDECLARED = dataclasses.replace(RIG, contraction_noise=None, pressure_noise=None)


def changed(change: Callable, white: float = 1.0, slow: float = 0.0) -> Recording:
    """Return a campaign with an effect [m] in its second repeat, a function of the command."""
    columns = arrays(0, white, slow)
    second = made().rows_of("holds_b")
    columns["contraction"][second] += change(columns["command"][second])
    return made(**columns)


def stroke(share: float) -> Callable:
    """Return another stroke: its RMS over that of noise in the difference of the repeats."""
    rms = np.sqrt(2.0) * NOISE["contraction"]
    return lambda command: share * rms * (command - command.mean()) / command.std()


def drift(command: np.ndarray) -> np.ndarray:
    return 9e-5 * np.linspace(0.0, 1.0, len(command)) ** 2


def contraction(recording: Recording, rig: Rig) -> ChannelFloor:
    return noise_floor(recording, rig)["contraction"]


@pytest.mark.parametrize("rig", [RIG, UNDECLARED])
@pytest.mark.parametrize("change", [stroke(0.7), stroke(1.0), drift])
def test_change_between_repeats_does_not_raise_noise_floor(rig, change):
    both = noise_floor(changed(change), rig)
    floor = both["contraction"]
    assert floor.estimates["repeats"] > 1.15 * NOISE["contraction"]
    assert floor.source in ("holds", "declared")
    assert floor.value == pytest.approx(NOISE["contraction"], rel=0.05)
    assert both["pressure"].source == "repeats"
    assert "contraction: the repeats differ by more than noise" in floor.warnings[0]
    assert "the muscle or the rig changed between the repeats" in floor.warnings[0]


@pytest.mark.parametrize(("white", "slow", "most"), [(1.0, 0.0, 0), (0.8, 0.6, 0), (0.7, 0.7, 1)])
def test_consistent_repeats_are_used(white, slow, most):
    """Slow noise is hard to know from short holds: there one in twenty may be doubted."""
    doubted = 0
    for seed in range(5):
        for rig in (RIG, UNDECLARED):
            floor = noise_floor(made(**arrays(seed, white, slow)), rig)
            believed = [floor[name].source == "repeats" for name in NOISE]
            doubted += believed.count(False)
            assert len(floor.warnings) == believed.count(False)
    assert doubted <= most


def test_small_effect_between_repeats_counts_as_noise():
    floor = contraction(changed(stroke(0.2)), RIG)
    assert floor.source == "repeats"
    assert floor.warnings == ()


def test_noise_of_motion_counts_as_noise():
    """Fast scatter outside holds is no change of the rig: every model leaves it as residual."""
    columns = arrays()
    for label in ("holds_a", "holds_b"):
        at = made().rows_of(label)
        at = at[np.arange(len(at)) % 200 < 90]  # while the muscle moves
        rng = np.random.default_rng(len(label) + ord(label[-1]))
        columns["contraction"][at] += 1.2 * NOISE["contraction"] * rng.standard_normal(len(at))
    floor = contraction(made(**columns), UNDECLARED)
    assert floor.estimates["repeats"] > 1.2 * floor.estimates["holds"]
    assert floor.source == "repeats"
    assert floor.warnings == ()


def test_declared_noise_below_holds_is_not_used():
    sure = dataclasses.replace(RIG, contraction_noise=0.75 * NOISE["contraction"])
    floor = contraction(changed(stroke(1.0)), sure)
    assert floor.source == "holds"
    assert floor.value == pytest.approx(NOISE["contraction"], rel=0.05)
    plain = contraction(made(), sure)
    assert plain.source == "repeats"
    assert plain.value == pytest.approx(NOISE["contraction"], rel=0.06)


def test_declared_noise_is_used_if_holds_agree():
    """Holds miss what is slower than they last, declared noise does not."""
    recording = changed(stroke(1.2), white=0.9, slow=0.3)
    floor = contraction(recording, RIG)
    assert floor.source in ("holds", "declared")
    assert floor.value == pytest.approx(
        max(NOISE["contraction"], floor.estimates["holds"]), rel=1e-6
    )


def test_declared_noise_is_compared_without_holds():
    n, period = 3000, 0.02
    rng = np.random.default_rng(3)
    one = 1e5 * (2.5 + 2.0 * np.sin(0.02 * np.arange(n)))
    command = np.tile(one, 2)
    contraction_ = 3e-8 * command + 3e-5 * rng.standard_normal(2 * n)
    contraction_[n:] *= 1.01
    recording = Recording.from_arrays(
        period * np.arange(2 * n),
        command,
        contraction=contraction_,
        segment=["a"] * n + ["b"] * n,
    )
    rig = Rig(contraction_noise=3.2e-5, repeats=(("a", "b"),))
    floor = contraction(recording, rig)
    assert "holds" not in floor.estimates
    assert floor.source == "declared"
    assert floor.value == 3.2e-5
    assert contraction(recording, dataclasses.replace(rig, contraction_noise=None)).source == (
        "repeats"
    )
