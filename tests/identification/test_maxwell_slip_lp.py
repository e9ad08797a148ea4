"""Linear programme of the modified Maxwell-slip model: exact fits, rank, open unknowns."""

import warnings

import numpy as np
import pytest

from pam_envs.hysteresis.modified_maxwell_slip import ModifiedMaxwellSlip, even_model
from pam_envs.identification.maxwell_slip_lp import (
    OpenParameters,
    fit_slip_programme,
    printed_programme,
)

FULL = 7110.0
EVEN = even_model(4.5e5, FULL, 0.5e5)


def _known() -> ModifiedMaxwellSlip:
    """Uneven elements and a bent spring, whose major loop ends at 4.5 bar."""
    friction = 5e3 * np.random.default_rng(3).uniform(0.3, 1.7, 10)
    breaks = 0.05 * FULL * np.arange(1, 11)
    part, total = np.linspace(0.0, 1.0, 11), friction.sum()
    bent = part + 0.12 * np.sin(np.pi * part) * (1.0 - part)
    spring = total + (4.5e5 - 2.0 * total) * bent
    return ModifiedMaxwellSlip(tuple(friction / breaks), tuple(breaks), tuple(spring), FULL / 10)


KNOWN = _known()


def loop(segments: int, model: ModifiedMaxwellSlip = KNOWN) -> tuple[np.ndarray, np.ndarray]:
    """Return pressure and stiffness of a vented loop with its peak on a break point."""
    up = np.linspace(0.0, segments * model.segment, 40 * segments + 1)
    path = np.concatenate([up, up[-2::-1]])
    return model.inverse_simulate(path)[0], path


def fit(*segments: int):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OpenParameters)
        return fit_slip_programme([loop(n) for n in segments])


@pytest.mark.parametrize(
    ("segments", "rank"),
    [
        ((10,), 16),
        ((10, 3), 17),
        ((10, 5), 18),
        ((10, 5, 3), 19),
        ((10, 8), 20),
        ((10, 9), 20),
        ((10, 9, 5), 20),
    ],
)
def test_rank_of_the_loop_sets(segments, rank):
    found = fit(*segments)
    assert (found.rank, found.unknowns) == (rank, 21)
    assert found.determined == (rank == 20)
    assert found.relative_objective < 1e-5


def test_enough_loops_recover_the_known_model():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fit_slip_programme([loop(10), loop(9)])
    assert found.open == ("k_10",)
    np.testing.assert_allclose(found.model.stiffnesses[:9], KNOWN.stiffnesses[:9], rtol=2e-3)
    # what the last element gives, the spring may give as well
    path = np.random.default_rng(0).uniform(0.0, 4.5e5, 200)
    ours, truth = (model.simulate(path)[0] for model in (found.model, KNOWN))
    np.testing.assert_allclose(ours, truth, rtol=0.0, atol=1e-3 * FULL)


def test_major_loop_alone_fits_itself_and_mispredicts_other_loops():
    found = fit(10)
    errors = []
    for segments in (10, 7):
        pressure, stiffness = loop(segments)
        errors.append(np.max(np.abs(found.model.simulate(pressure)[0] - stiffness)) / FULL)
    assert errors[0] < 1e-4
    assert errors[1] > 0.01


def test_too_few_loops_warn_with_the_number_of_unidentified_unknowns():
    with pytest.warns(OpenParameters, match=r"16 of 21 unknowns; .*k_9, k_10 stay open") as caught:
        fit_slip_programme([loop(10)])
    assert "minor loop" in str(caught[0].message)
    assert "k_5," not in str(caught[0].message)  # the one that a major loop of ten does fix


@pytest.mark.parametrize(("segments", "rank"), [((10, 5), 18), ((10, 4.83), 18), ((10, 9), 20)])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 3e-3])
def test_noise_or_a_turn_between_breaks_adds_no_rank(segments, rank, noise):
    rng, loops = np.random.default_rng(1), []
    for n in segments:
        up = np.linspace(0.0, n * EVEN.segment, round(40 * n) + 1)
        path = np.concatenate([up, up[-2::-1]])
        pressure = EVEN.inverse_simulate(path)[0]
        seen = path + noise * FULL * rng.normal(size=path.size)
        loops.append((pressure, np.concatenate([[0.0], seen[1:]])))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OpenParameters)
        found = fit_slip_programme(loops)
    assert found.rank == rank
    assert ("k_9" in found.open) == (rank < 20)
    assert "k_10" in found.open


@pytest.mark.parametrize("model", [EVEN, KNOWN])
def test_printed_right_hand_sides_do_not_fit_a_known_model(model):
    objective, spring = printed_programme([loop(10, model)])
    assert objective > 0.1
    assert np.any(np.diff(spring) < 0.0)


def test_printed_objective_of_even_elements():
    objective, _ = printed_programme([loop(10, EVEN)])
    assert 4.5 * objective == pytest.approx(0.99, abs=0.01)  # [bar]


def test_pressure_cycles_with_free_peaks_are_accepted():
    phase = np.linspace(0.0, 2.0 * np.pi, 2001)
    loops = []
    for peak in (4.5e5, 1.5e5, 3.8e5):
        pressure = 0.5 * peak * (1.0 - np.cos(phase))
        loops.append((pressure, KNOWN.simulate(pressure)[0]))
    found = fit_slip_programme(loops)
    assert found.rank == 20
    pressure = 1.25e5 * (1.0 - np.cos(phase))
    error = found.model.simulate(pressure)[0] - KNOWN.simulate(pressure)[0]
    assert np.max(np.abs(error)) < 2e-3 * FULL


def test_noisy_loops_give_a_valid_model_near_the_known_one():
    rng = np.random.default_rng(4)
    loops = [(p + rng.normal(0.0, 500.0, len(p)) * (s > 0.0), s) for p, s in (loop(10), loop(9))]
    found = fit_slip_programme(loops)
    pressure, stiffness = loop(6)
    error = np.max(np.abs(found.model.simulate(pressure)[0] - stiffness))
    assert 1e-4 * FULL < error < 0.01 * FULL


@pytest.mark.parametrize(
    ("loops", "message"),
    [
        ([], "loops is empty"),
        ([(np.linspace(1e5, 4e5, 9), np.linspace(0.0, 7e3, 9))], "does not rise and fall"),
        ([(np.array([1e5, 4e5, 1e5]), np.array([0.0, 7e3, 0.0]))], "begins at a pressure of 1e"),
        ([(np.array([0.0, 4e5, 0.0]), np.array([1e3, 7e3, 1e3]))], "begins at a stiffness of 1000"),
    ],
)
def test_bad_loops_are_refused(loops, message):
    with pytest.raises(ValueError, match=message):
        fit_slip_programme(loops)
    with pytest.raises(ValueError, match="elements is 0"):
        fit_slip_programme([loop(10)], elements=0)
