"""Diagnosis of the horizontal force missing in yeh2010, Eq. 1, on held-out strides."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.gait import diagnosis as study
from benchmarks.diagnosis.gait.recording import GaitRecording, record
from pam_envs.references.gait import NATURAL_STRIDE, PAPER_STRIDE

STRIDES = 18


def torques(recording: GaitRecording, **changes: float) -> np.ndarray:
    family = study.GaitEstimate(recording)
    values = family.values | {name.replace("_", "."): value for name, value in changes.items()}
    return family.simulate(np.array(list(values.values()))[None])[0, :, 0]


def hiding(name: str, value: float, seed: int = 1) -> GaitRecording:
    """Return strides of a laboratory in which one thing alone is not as Eq. (1) has it."""
    quiet, noisy = (record(NATURAL_STRIDE, STRIDES, seed, noise) for noise in (0.0, 1.0))
    true = torques(quiet, **{name: value} if name else {})
    true = true + np.random.default_rng(seed).standard_normal(len(true))
    return replace(noisy, torque=np.where(np.isfinite(noisy.torque), true, np.nan))


@pytest.fixture(scope="module")
def natural():
    return study.diagnose(record(NATURAL_STRIDE, STRIDES, 1))


@pytest.mark.parametrize("pace", [NATURAL_STRIDE, PAPER_STRIDE])
def test_full_balance_is_equation_1_with_force_weight_and_inertia(pace):
    made = record(pace, 3, noise=0.0)
    whole = torques(made, horizontal_share=1.0, weight_share=1.0, inertia_share=1.0)
    seen = np.isfinite(made.torque)
    assert np.abs(whole - made.torque)[seen].max() < 0.3
    part = torques(made, weight_share=1.0, inertia_share=1.0)
    height = made.leg.ankle_height + made.leg.shank * np.cos(made.lean)
    assert np.allclose(part - whole, made.horizontal * height)


def test_strides_differ_and_are_held_out_whole():
    made = record(NATURAL_STRIDE, STRIDES, 1)
    lengths = np.bincount(made.stride)
    assert len(lengths) == STRIDES
    assert np.ptp(lengths) > 5
    blocks = study.blocks_of(made)
    assert blocks.held_out.sum() == STRIDES // 3
    assert all(len(np.unique(blocks.train[made.stride == k])) == 1 for k in range(STRIDES))


def test_horizontal_force_is_named_at_natural_pace(natural):
    assert natural.decision.verdict == "named"
    assert natural.names[0] == "horizontal_force"
    assert natural.values["horizontal.share"] == pytest.approx(1.0, abs=0.05)
    gains = {c.name: natural.gain_of(c.name) for c in study.CAUSES}
    best = gains.pop("horizontal_force")
    assert best > 3.5
    assert np.nanmax(list(gains.values())) < 0.25 * best
    assert not {"sole_shift", "lean_bias", "delay", "force_gain"} & set(natural.names)

    before, after = natural.error(natural.base), natural.error(natural.decision.model)
    assert before > 20.0
    assert after < 1.3 * natural.problem.noise[0]


def test_two_paces_identify_the_share_within_a_few_percent():
    both = record(NATURAL_STRIDE, STRIDES, 1).and_then(record(PAPER_STRIDE, 9, 51))
    found = study.diagnose(both)
    assert found.names[0] == "horizontal_force"
    assert found.values["horizontal.share"] == pytest.approx(1.0, abs=0.02)


def test_shank_weight_is_named_at_the_papers_pace():
    found = study.diagnose(record(PAPER_STRIDE, STRIDES, 1))
    assert "shank_weight" in found.names  # which of two is found first depends on the draw
    assert "horizontal_force" not in found.names
    assert found.error(found.base) < 4.0


def test_second_pace_removes_confusion_of_one_pace():
    one = study.diagnose(record(3.0, STRIDES, 1))
    assert "horizontal_force" not in one.names
    assert one.gain_of("horizontal_force") > 0.8 * one.gain_of("lean_bias")
    two = study.diagnose(record(3.0, STRIDES, 1).and_then(record(2.0, 9, 51)))
    assert two.names[0] == "horizontal_force"
    assert two.values["horizontal.share"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("name", "value", "cause"),
    [
        ("", 0.0, ""),
        ("lean_bias", 0.04, "lean_bias"),
        ("shoe_delay", 0.03, "delay"),
        ("force_gain", -0.1, "force_gain"),
        ("weight_share", 1.0, "shank_weight"),
    ],
)
def test_other_effects_are_not_named_horizontal_force(name, value, cause):
    found = study.diagnose(hiding(name, value))
    assert found.names == ((cause,) if cause else ())
    assert found.decision.verdict == ("named" if cause else "adequate")
    if cause:
        assert found.values[name.replace("_", ".")] == pytest.approx(value, rel=0.1)


def test_noise_is_separated_from_motion_and_model_error():
    stride = np.repeat(np.arange(10), 120)
    values = 50.0 * np.sin(np.arange(1200) / 20.0) + 100.0 * stride
    noisy = values + 1.5 * np.random.default_rng(0).standard_normal(1200)
    noisy[::7][:20] = np.nan
    assert study.white_noise(noisy, stride) == pytest.approx(1.5, rel=0.1)


def test_recordings_of_two_legs_are_not_concatenated():
    made = record(NATURAL_STRIDE, 2)
    with pytest.raises(ValueError, match="of one leg"):
        made.and_then(replace(made, leg=replace(made.leg, body_mass=60.0)))


def test_results_page_names_the_horizontal_force(capsys):
    study.main(strides=12)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("1.224 s a stride: named; horizontal.share 1.0")
    assert lines[1].startswith("  1: horizontal_force")
