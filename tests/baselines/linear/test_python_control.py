"""Cross-checks with python-control and with theory."""

from __future__ import annotations

import importlib.util

import control
import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from baselines.knee.published import (
    CONTROLLER_DENOMINATOR,
    CONTROLLER_NUMERATOR,
    printed_controller,
    printed_plant,
)
from baselines.linear.ltr import _regulator, design_ltr, integrator, loop_figures
from baselines.linear.reduction import residualised
from baselines.linear.systems import DiscreteSystem, discrete, from_roots, state_space

PLANT = printed_plant()


def test_cost_of_the_regulated_loop_is_the_riccati_solutions():
    scaled = state_space(PLANT.A / 10.0, PLANT.B / 10.0, PLANT.C)
    augmented, weight = scaled * integrator(), 1e-4
    gain = _regulator(augmented, weight, 1.0)
    q = augmented.C.T @ augmented.C
    riccati = control.care(augmented.A, augmented.B, q, [[weight]], method="scipy")[0]
    closed = augmented.A - augmented.B @ gain
    cost = solve_continuous_lyapunov(closed.T, -(q + weight * gain.T @ gain))
    for start in np.eye(augmented.nstates):
        assert start @ cost @ start == pytest.approx(start @ riccati @ start, rel=1e-3)


def test_recovered_loop_tends_to_the_phase_margin_of_an_integrator():
    designs = [design_ltr(PLANT, 26.2, weight) for weight in (1e-6, 1e-10, 1e-14)]
    phases = [np.degrees(design.figures.phase_margin) for design in designs]
    assert 60.0 < phases[0] < phases[1] < phases[2] < 90.0
    assert phases[2] > 79.0


def test_margins_are_those_of_the_rational_loop():
    plant, controller = PLANT, printed_controller()
    gain, phase, distance, _, crossover, _ = control.stability_margins(plant * controller)
    figures = loop_figures(lambda w: plant(1j * w) * controller(1j * w))
    assert figures.gain_margin == pytest.approx(gain, rel=1e-6)
    assert np.degrees(figures.phase_margin) == pytest.approx(phase, rel=1e-6)
    assert figures.crossover == pytest.approx(crossover, rel=1e-6)
    assert figures.peak_sensitivity == pytest.approx(1.0 / distance, rel=1e-6)


def test_balanced_form_keeps_zeros_that_the_plain_companion_form_loses():
    exact = np.sort_complex(np.roots(CONTROLLER_NUMERATOR))
    plain = control.ss(control.tf(CONTROLLER_NUMERATOR, CONTROLLER_DENOMINATOR), method="scipy")

    def error(zeros):
        return max(np.min(np.abs(zeros - zero)) / abs(zero) for zero in exact)

    assert error(printed_controller().zeros()) < 1e-10
    if importlib.util.find_spec("slycot") is None:
        assert error(plain.zeros()) > 1e-2


def test_discrete_system_is_python_controls():
    system = discrete(printed_controller(), 0.01)
    sampled = control.ss(system.a, system.b[:, None], system.c[None, :], system.d, 0.01)
    inputs = np.random.default_rng(0).normal(size=50)
    outputs = control.forced_response(sampled, inputs=inputs).outputs
    state = system.initial_state()
    for value, expected in zip(inputs, outputs, strict=True):
        output, state = system.step(value, state)
        assert output == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_lanes_are_single_systems():
    poles = (2.0, 5.0, 23.0)
    singles = [discrete(from_roots([], [-pole, -2 * pole], 1.0), 0.01) for pole in poles]
    lanes, u = DiscreteSystem.stacked(singles), np.array([[1.0, -2.0, 0.5]] * 2)
    state = lanes.rest_state(u)
    np.testing.assert_allclose(lanes.advance(u, state), state, atol=1e-12)
    for k, single in enumerate(singles):
        np.testing.assert_array_equal(
            lanes.output(u, state)[:, k], single.output(u[:, k], state[:, k])
        )


def test_residualisation_is_slicots():
    pytest.importorskip("slycot")
    system = from_roots([-4.0, -40.0], [-1.0, -5.0, -30.0, -200.0], 2.0)
    w = 1j * np.geomspace(1e-2, 1e3, 50)
    theirs = control.balred(system, 2, method="matchdc")
    np.testing.assert_allclose(residualised(system, 2)[0](w), theirs(w), rtol=1e-9)
