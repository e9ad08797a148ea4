"""Yielding element: exact steps, limits, energy, rate independence."""

from functools import partial

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from pam_envs.kernels.yielding import decayed_over, deflected, log_over, yielded

RATIOS = (0.0, 1e-6, 0.4, 1.0)
PATHS = 12


def paths(seed: int) -> list[np.ndarray]:
    """Draw paths of 10 monotonic motions each, in units of the break, from small to large."""
    random = np.random.default_rng(seed)
    size = 10.0 ** random.uniform(-2.0, 0.7, (PATHS, 1))
    return list(size * random.uniform(-1.0, 1.0, (PATHS, 10)))


def integrated(z: float, moved: float, ratio: float) -> float:
    """Integrate the equation of Bouc and Wen over a motion in units of the break."""
    sign, along = np.sign(moved), 0.5 * (1.0 - ratio)
    against = 1.0 - along

    def rate(_: float, z: np.ndarray) -> np.ndarray:
        return sign * (1.0 - np.abs(z) * (against * sign * np.sign(z) + along))

    return float(solve_ivp(rate, (0.0, abs(moved)), [z], rtol=1e-9, atol=1e-11).y[0, -1])


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("z", [-1.0, 0.0, 0.6])
@pytest.mark.parametrize("moved", [-3.0, -0.7, -0.2, 0.2, 0.9])
def test_step_solves_the_equation_of_bouc_and_wen(z: float, moved: float, ratio: float) -> None:
    after, slope = yielded(z, moved, ratio)
    assert after == pytest.approx(integrated(z, moved, ratio), abs=2e-8)
    more = np.copysign(1e-6, moved)
    assert slope == pytest.approx((yielded(after, more, ratio)[0] - after) / more, abs=3e-6)


def test_ratio_1_is_the_friction_of_dahl() -> None:
    for z in np.linspace(-1.0, 1.0, 9):
        for moved in np.linspace(-6.0, 6.0, 25):
            sign = np.copysign(1.0, moved)
            closed = sign + (z - sign) * np.exp(-abs(moved))
            assert yielded(z, moved, 1.0)[0] == pytest.approx(closed, abs=1e-11)


def test_ratio_0_springs_back() -> None:
    z, slope = yielded(0.8, -0.5, 0.0)
    assert z == pytest.approx(0.3, abs=1e-15)
    assert slope == 1.0


def test_series_equal_logarithm_and_exponential() -> None:
    x = np.linspace(1e-3, 1.0, 50)
    assert [log_over(v) for v in x] == pytest.approx(np.log1p(x) / x, rel=1e-14)
    assert [decayed_over(v) for v in x] == pytest.approx(-np.expm1(-x) / x, rel=1e-14)
    assert (log_over(0.0), decayed_over(0.0)) == (1.0, 1.0)


@pytest.mark.parametrize("ratio", RATIOS)
def test_share_stays_within_its_limits(ratio: float) -> None:
    for start in (-1.0, 0.3, 1.0):
        z = start
        for path in paths(1):
            for moved in np.concatenate([path, 1e3 * path]):
                z, slope = yielded(z, moved, ratio)
                assert -1.0 <= z <= 1.0
                assert 0.0 <= slope <= 1.0 + ratio


@pytest.mark.parametrize("ratio", RATIOS)
def test_sub_steps_do_not_matter(ratio: float) -> None:
    for path in paths(2):
        once = parts = 0.0
        for moved in path:
            once = yielded(once, moved, ratio)[0]
            for _ in range(7):
                parts = yielded(parts, moved / 7.0, ratio)[0]
            assert parts == pytest.approx(once, abs=1e-11)


@pytest.mark.parametrize("ratio", RATIOS)
def test_closed_cycles_create_no_energy(ratio: float) -> None:
    """From no friction the work is at least the energy stored, and 0 or more on closed cycles."""
    for path in paths(3):
        z = work = 0.0
        for moved in [*path, -path.sum()]:
            force = partial(_force, z, 1.0, ratio)
            work += quad(force, 0.0, moved, epsabs=1e-10, limit=200)[0]
            z = force(moved)
            assert work >= 0.5 * z * z - 1e-9
        assert work > 0.0


@pytest.mark.parametrize(("ratio", "sign"), [(-0.2, 1), (0.0, 0), (0.5, -1)])
def test_spring_gives_back_its_stored_energy_at_most_from_ratio_0(ratio: float, sign: int) -> None:
    z = 0.9
    away = -z * log_over(ratio * z)  # to no friction
    given = -quad(partial(_force, z, 1.0, ratio), 0.0, away)[0]
    assert yielded(z, away, ratio)[0] == pytest.approx(0.0, abs=1e-12)
    assert np.sign(round(given - 0.5 * z * z, 9)) == sign


@pytest.mark.parametrize("ratio", RATIOS)
def test_changes_of_the_limit_create_no_energy(ratio: float) -> None:
    """The spring is the same at any limit; a limit below the deflection only releases it."""
    random = np.random.default_rng(5)
    for path in paths(4):
        at = work = 0.0
        for moved in path:
            limit = max(0.0, random.uniform(-0.3, 3.0))
            force = partial(_force, at, limit, ratio)
            turn = np.clip(-at, *sorted((0.0, moved)))  # near the change of sign
            for low, high in ((0.0, turn), (turn, moved)):
                work += quad(force, low, high, epsabs=1e-10, limit=200)[0]
            at = force(moved)
            assert abs(at) <= max(limit, 1e-12)
            assert work >= 0.5 * at**2 - 1e-7


def _force(at: float, limit: float, ratio: float, moved: float) -> float:
    return deflected(at, moved, limit, ratio)[0]


def test_minor_loops_drift_and_do_not_close() -> None:
    """Play operators close every minor loop; the friction of Dahl relaxes within it."""
    start = z = yielded(0.0, 2.0, 1.0)[0]
    ends = [z := yielded(yielded(z, -0.2, 1.0)[0], 0.2, 1.0)[0] for _ in range(100)]
    assert ends[0] < start - 0.1
    assert ends[-1] == pytest.approx(np.tanh(0.1), abs=1e-9)  # the loop about zero
