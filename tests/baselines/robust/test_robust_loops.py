"""Synthesised disturbance loops: robust performance, reduction, reproduction."""

import importlib.util

import numpy as np
import pytest

from baselines.linear.ltr import integrator
from baselines.linear.systems import discrete, from_roots, response
from baselines.robust import synthesis
from baselines.robust.requirements import (
    FREQUENCIES,
    RobustDesign,
    frozen,
    robust_controller,
    sensitivity,
)
from baselines.robust.synthesis import residualised, split, without_fast

DESIGN = RobustDesign()


def _loop(kind, stage="reduced"):
    controller = robust_controller(kind, stage)
    return response(DESIGN.plant, FREQUENCIES) * response(controller, FREQUENCIES)


@pytest.mark.parametrize("kind", ["mu", "hinf"])
def test_reduced_loops_follow_from_the_synthesised_ones(kind):
    # kernels of BLAS for other processors change the values by 3e-6, the response by 7e-5
    made, sizes = synthesis.reduced_controller(robust_controller(kind, "full"))
    np.testing.assert_allclose(sizes[:2], frozen()[kind]["hankel"][:2], rtol=1e-5)
    kept = robust_controller(kind)
    np.testing.assert_allclose(made(1j * FREQUENCIES), kept(1j * FREQUENCIES), rtol=2e-4)


@pytest.mark.parametrize("stage", ["full", "reduced"])
def test_mu_loop_is_robust_and_h_infinity_loop_narrowly_fails(stage):
    value = {kind: DESIGN.structured_value(_loop(kind, stage)).max() for kind in ("mu", "hinf")}
    assert value["mu"] < 1.0 < value["hinf"] < 1.1
    assert frozen()["mu"][f"mu_{stage}"] == pytest.approx(value["mu"], rel=1e-6)


def test_bound_of_slicot_equals_the_exact_value():
    for kind in ("mu", "hinf"):
        exact = DESIGN.structured_value(_loop(kind)).max()
        assert frozen()[kind]["mu_bound_ab13md"] == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(("frequency", "size"), [(0.1, 0.013), (1.0, 0.126), (4.0, 0.443)])
def test_sensitivity_has_the_documented_values(frequency, size):
    found = np.interp(frequency, FREQUENCIES, sensitivity(_loop("mu")))
    assert found == pytest.approx(size, rel=0.02)
    assert sensitivity(_loop("mu")).max() < 1.07


def test_structured_value_marks_the_worst_plant_that_violates_the_bound():
    loop, k = _loop("mu"), 230
    value = DESIGN.structured_value(loop)[k]
    asked = abs(DESIGN.performance(1j * FREQUENCIES[k]))
    neglected = abs(DESIGN.neglected(1j * FREQUENCIES[k]) * loop[k])

    def worst(size):
        gains = 1.0 + DESIGN.gain_spread * size * np.linspace(-1.0, 1.0, 2001)
        return size * asked / (np.min(np.abs(1.0 + gains * loop[k])) - size * neglected)

    assert worst(0.999 / value) < 1.0 < worst(1.001 / value)
    tracking = np.abs(loop[k] / (1.0 + loop[k]))
    spread = DESIGN.gain_spread + abs(DESIGN.neglected(1j * FREQUENCIES[k]))
    assert value <= spread * tracking + asked / abs(1.0 + loop[k]) + 1e-12  # with a complex gain


def test_sampled_loops_are_stable_over_the_sector():
    for kind in ("mu", "hinf"):
        controller = discrete(robust_controller(kind), 0.01)
        plant = discrete(DESIGN.plant, 0.01, "zoh")
        for gain in (0.65, 1.0, 1.35):
            loop = np.block(
                [
                    [plant.a - gain * controller.d * np.outer(plant.b, plant.c),
                     gain * np.outer(plant.b, controller.c)],
                    [-np.outer(controller.b, plant.c), controller.a],
                ]
            )  # fmt: skip
            assert np.max(np.abs(np.linalg.eigvals(loop))) < 1.0


def test_loop_of_a_slower_joint_is_scaled_in_time():
    fast, slow = robust_controller("mu"), robust_controller("mu", pole=11.5)
    w = np.geomspace(0.1, 100.0, 20)
    np.testing.assert_allclose(slow(1j * 0.5 * w), fast(1j * w), rtol=1e-9)


def test_reduction_keeps_the_static_gain_and_its_error_bound():
    system = from_roots([-4.0, -40.0], [-1.0, -5.0, -30.0, -200.0], 2.0)
    small, sizes = residualised(system, 2)
    w = np.geomspace(1e-3, 1e4, 200)
    assert small.dcgain() == pytest.approx(2.0, rel=1e-9)
    error = np.abs(small(1j * w) - system(1j * w))
    assert 0.0 < error.max() <= 2.0 * sizes[2:].sum() * (1.0 + 1e-6)
    with pytest.raises(ValueError, match="order is 5 of 4"):
        residualised(system, 5)


def test_sum_of_split_parts_is_the_system():
    system = from_roots([-4.0], [-0.01, -5.0, -6.0, -3e4], 1.0)
    within, beyond = split(system, 0.1)
    w = np.geomspace(1e-3, 1e5, 50)
    both = within(1j * w) + beyond(1j * w)
    np.testing.assert_allclose(both, system(1j * w), rtol=1e-9)
    assert without_fast(system, 1e3).nstates == 3
    joined = (integrator(2.0) + beyond)(1j * w)
    np.testing.assert_allclose(joined, 2.0 / (1j * w) + beyond(1j * w), rtol=1e-9)
    with pytest.raises(ValueError, match="separates them"):
        split(system, 1e6)


@pytest.mark.skipif(importlib.util.find_spec("slycot") is None, reason="the extra is not there")
@pytest.mark.filterwarnings("ignore")
def test_synthesis_reproduces_the_frozen_loops():
    hinf, mu, rounds = synthesis.d_k_iteration(DESIGN)
    np.testing.assert_allclose(rounds, frozen()["mu_by_round"], rtol=1e-4)
    for kind, controller in (("hinf", hinf), ("mu", mu)):
        made = DESIGN.structured_value(synthesis.loop_of(DESIGN, controller)).max()
        assert made == pytest.approx(frozen()[kind]["mu_full"], rel=1e-4)


def test_fitted_scale_and_its_inverse_are_stable():
    desired = np.abs(from_roots([-3.0, -90.0], [-12.0, -40.0], 1.5)(1j * FREQUENCIES))
    made = synthesis.fit_scale(desired)
    assert np.max(made.poles().real) < 0.0 and np.max(made.zeros().real) < 0.0
    fitted = np.abs(made(1j * FREQUENCIES[synthesis.FITTED]))
    np.testing.assert_allclose(fitted, desired[synthesis.FITTED], rtol=1e-3)
