"""Loop transfer recovery and linear systems against theory and python-control."""

import importlib.util
import math

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
from baselines.linear.ltr import (
    _regulator,
    closed_loop_poles,
    design_ltr,
    integrator,
    loop_figures,
    sampled_figures,
)
from baselines.linear.systems import (
    DiscreteSystem,
    discrete,
    from_polynomials,
    from_roots,
    state_space,
)
from baselines.robust.synthesis import residualised
from pam_envs.identification.frequency import fit_rational

PLANT = printed_plant()
W = np.geomspace(0.1, 60.0, 50)


def test_system_has_its_transfer_function():
    top, low = [3.0, 5.0], [2.0, 7.0, 11.0, 1.0]
    system = from_polynomials(top, low)
    s = 1j * W
    np.testing.assert_allclose(system(1j * W), np.polyval(top, s) / np.polyval(low, s), rtol=1e-12)
    np.testing.assert_allclose(system.zeros(), [-5.0 / 3.0], rtol=1e-10)
    assert system.dcgain() == pytest.approx(5.0)


def test_system_from_roots_and_in_series_has_its_response():
    first = from_roots([-3.0], [-1.0, -2.0 + 1j, -2.0 - 1j], 0.5)
    second = from_polynomials([1.0, 2.0], [1.0, 9.0])
    assert first.dcgain() == pytest.approx(0.5)
    np.testing.assert_allclose((second * first)(1j * W), first(1j * W) * second(1j * W), rtol=1e-10)


def test_recovered_loop_is_the_target_integrator():
    w = np.geomspace(0.1, 26.2, 20)
    errors = []
    for weight in (1e-8, 1e-12, 1e-16):
        controller = design_ltr(PLANT, 26.2, weight).controller
        recovered = PLANT(1j * w) * controller(1j * w) * 1j * w / 26.2
        errors.append(np.max(np.abs(recovered - 1.0)))
    assert errors[2] < 0.18
    # the distance falls with the eighth root: 10**0.5 = 3.2 for each of these steps in the limit
    assert 1.7 < errors[0] / errors[1] < errors[1] / errors[2] < 3.2


def test_design_has_the_published_bandwidth_of_26_2():
    figures = design_ltr(PLANT, 26.2, 1e-10).figures
    assert figures.bandwidth == pytest.approx(26.19, abs=0.015)
    assert figures.peak_tracking < 1.001


def test_controller_has_an_integrator_and_zeros_on_the_plants_poles():
    controller = design_ltr(PLANT, 26.2, 1e-8).controller
    assert np.min(np.abs(controller.poles())) < 1e-9
    assert controller.nstates == PLANT.nstates + 2
    on_poles = np.abs(controller(1j * np.array([1e-4]))) * 1e-4
    assert on_poles == pytest.approx(np.abs(controller(1j * np.array([1e-5]))) * 1e-5, rel=1e-3)
    found = np.sort_complex(controller.zeros())
    np.testing.assert_allclose(found, np.sort_complex(PLANT.poles()), atol=1e-3)


@pytest.mark.parametrize(("bandwidth", "weight"), [(5.0, 1e-6), (26.2, 1e-8), (60.0, 1e-10)])
def test_closed_loop_is_stable_with_the_poles_of_filter_and_regulator(bandwidth, weight):
    design = design_ltr(PLANT, bandwidth, weight)
    poles = closed_loop_poles(design.plant, design.controller)
    assert np.all(poles.real < 0.0)
    # separation: the filter keeps the plant's poles and one at the bandwidth
    for expected in [*PLANT.poles(), -bandwidth]:
        assert np.min(np.abs(poles - expected)) < 1e-2 * abs(expected)


def test_figures_of_a_known_loop_are_exact():
    figures = loop_figures(lambda w: 10.0 / (1j * w * (1.0 + 0.05j * w) ** 2))
    assert figures.gain_margin == pytest.approx(4.0, rel=1e-3)  # 2 / tau over 10
    crossing = figures.crossover
    assert crossing * (1.0 + (0.05 * crossing) ** 2) == pytest.approx(10.0)
    phase = math.pi / 2.0 - 2.0 * math.atan(0.05 * crossing)
    assert figures.phase_margin == pytest.approx(phase, rel=1e-5)
    assert figures.delay_margin == pytest.approx(phase / crossing, rel=1e-5)


def test_first_order_loop_has_no_peak():
    figures = loop_figures(lambda w: 7.0 / (1j * w))
    assert figures.bandwidth == pytest.approx(7.0, rel=1e-5)
    assert figures.peak_tracking == pytest.approx(1.0, abs=1e-5)
    assert figures.gain_margin == math.inf


def test_discrete_controller_keeps_integrator_and_response():
    controller = printed_controller()
    sampled = discrete(controller, 0.01)
    assert np.max(np.abs(np.linalg.eigvals(sampled.a))) == pytest.approx(1.0, abs=1e-9)
    w = np.array([0.5, 5.0, 20.0])
    np.testing.assert_allclose(sampled.response(w), controller(1j * w), rtol=0.012)


def test_rest_state_is_an_equilibrium():
    held = discrete(PLANT, 0.01, "zoh")
    state = held.rest_state(200.0)
    assert held.output(0.0, state) == pytest.approx(200.0 * PLANT.dcgain())
    np.testing.assert_allclose(held.advance(200.0, state), state, rtol=1e-12, atol=1e-12)


def test_sampling_and_delay_reduce_the_phase_margin():
    design = design_ltr(PLANT, 26.2, 1e-8)
    smooth, sampled = design.figures, design.sampled_figures(0.01)
    late = design.sampled_figures(0.01, delay=0.01)
    lost = smooth.phase_margin - sampled.phase_margin
    assert lost == pytest.approx(0.005 * smooth.crossover, rel=0.1)  # half a period of the hold
    lost = sampled.phase_margin - late.phase_margin
    assert lost == pytest.approx(0.01 * sampled.crossover, rel=1e-3)
    near = sampled_figures(PLANT, discrete(design.controller, 0.01), 0.9 * sampled.delay_margin)
    assert near.bandwidth > 0.0


def test_sampled_loop_becomes_unstable_at_the_delay_margin():
    controller = discrete(printed_controller(), 0.01)
    plant = discrete(PLANT, 0.01, "zoh")
    margin = sampled_figures(PLANT, controller).delay_margin

    def growth(delay: int) -> float:
        """Return the size of the error after 20 s over that after 10 s."""
        inside, state = plant.initial_state(), controller.initial_state()
        waiting, sizes = [0.0] * delay, []
        for _ in range(2000):
            error = 1.0 - float(inside @ plant.c)
            command, state = controller.step(error, state)
            waiting.append(float(command))
            inside = plant.advance(waiting.pop(0), inside)
            sizes.append(abs(error))
        return max(sizes[-300:]) / max(sizes[700:1000])

    steps = margin / 0.01
    assert growth(math.floor(steps) - 1) < 0.5
    assert growth(math.ceil(steps) + 1) > 2.0


def test_controller_from_a_noisy_frequency_response_is_stable_on_the_plant():
    """A noisy response, a fit of low order, a loop on the true plant."""
    rng = np.random.default_rng(2)
    w = 2.0 * np.pi * np.geomspace(0.1, 2.0, 40)
    noise = 1.0 + 0.01 * (rng.normal(size=40) + 1j * rng.normal(size=40))
    fit = fit_rational(w, PLANT(1j * w) * noise, 3, relative_degree=3)
    design = design_ltr(fit, 15.0, 1e-7)
    poles = closed_loop_poles(PLANT, design.controller)
    assert np.all(poles.real < 0.0)
    on_true = loop_figures(lambda x: PLANT(1j * x) * design.controller(1j * x))
    assert on_true.bandwidth == pytest.approx(15.0, rel=0.15)
    assert on_true.phase_margin > math.radians(50.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: design_ltr(from_roots([5.0], [-1.0, -2.0], 1.0), 5.0, 1e-4), "zero is at 5"),
        (lambda: design_ltr(from_polynomials([1], [1, 0]), 5.0, 1e-4), "pole has real part"),
        (lambda: design_ltr(from_polynomials([1, 2], [1, 1]), 5.0, 1e-4), "strictly proper"),
        (lambda: design_ltr(PLANT, 0.0, 1e-4), "bandwidth is 0.0"),
        (lambda: design_ltr(PLANT, 5.0, -1.0), "control_weight is -1.0"),
        (lambda: design_ltr(PLANT, 26.2, 1e-20), "too small for the arithmetic"),
        (lambda: state_space(np.eye(3), np.ones(2), np.ones(2)), "dimensions of B"),
        (lambda: from_polynomials([1.0, 2.0, 3.0], [1.0, 1.0]), r"(?i)proper"),
        (lambda: discrete(PLANT, 0.0), "period is 0"),
    ],
)
def test_invalid_systems_and_designs_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


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


def test_discrete_system_agrees_with_python_control():
    system = discrete(printed_controller(), 0.01)
    sampled = control.ss(system.a, system.b[:, None], system.c[None, :], system.d, 0.01)
    inputs = np.random.default_rng(0).normal(size=50)
    outputs = control.forced_response(sampled, inputs=inputs).outputs
    state = system.initial_state()
    for value, expected in zip(inputs, outputs, strict=True):
        output, state = system.step(value, state)
        assert output == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_lanes_equal_single_systems():
    poles = (2.0, 5.0, 23.0)
    singles = [discrete(from_roots([], [-pole, -2 * pole], 1.0), 0.01) for pole in poles]
    lanes, u = DiscreteSystem.stacked(singles), np.array([[1.0, -2.0, 0.5]] * 2)
    state = lanes.rest_state(u)
    np.testing.assert_allclose(lanes.advance(u, state), state, atol=1e-12)
    for k, single in enumerate(singles):
        own = single.output(u[:, k], state[:, k])
        np.testing.assert_array_equal(lanes.output(u, state)[:, k], own)


def test_residualisation_agrees_with_slicot():
    pytest.importorskip("slycot")
    system = from_roots([-4.0, -40.0], [-1.0, -5.0, -30.0, -200.0], 2.0)
    w = 1j * np.geomspace(1e-2, 1e3, 50)
    theirs = control.balred(system, 2, method="matchdc")
    np.testing.assert_allclose(residualised(system, 2)[0](w), theirs(w), rtol=1e-9)


def test_zero_at_infinity_is_no_zero():
    plain = from_polynomials([4.0], [1.0, 5.0, 4.0])
    output = np.where(plain.C == 0.0, -1e-16, plain.C)
    rounded = state_space(plain.A, plain.B, output)
    assert rounded.zeros()[0].real > 1e12
    expected, found = (design_ltr(plant, 2.0, 1e-4).controller for plant in (plain, rounded))
    np.testing.assert_allclose(found(1j * W), expected(1j * W), rtol=1e-6)
