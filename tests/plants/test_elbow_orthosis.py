"""The elbow orthosis at rest: published torques, stiffness, allocation, hysteresis, files."""

import dataclasses

import numpy as np
import pytest

from pam_envs.hysteresis.preisach import Preisach
from pam_envs.hysteresis.protocol import kinds
from pam_envs.mechanics import allocation
from pam_envs.plants.elbow_orthosis.bundles import (
    contraction_at,
    factors_of,
    friction_of,
    shape_of,
    travel_at,
    volume_of,
    weight_of,
)
from pam_envs.plants.elbow_orthosis.hysteresis import (
    ElbowHysteresis,
    elbow_hysteresis,
    travel_plays,
)
from pam_envs.plants.elbow_orthosis.plant import ElbowOrthosis

FULL = 6e5
ANGLES = np.radians([0.0, 60.0, 120.0])
RANGE = np.linspace(0.0, np.radians(120.0), 49)
COUNTS = ((1, 1), (1, 6), (3, 7), (5, 2), (8, 12))


def orthosis(a: int = 3, b: int = 7, **changes: float) -> ElbowOrthosis:
    return ElbowOrthosis.paper("none", bundle_a__muscles=a, bundle_b__muscles=b, **changes)


@pytest.mark.parametrize(
    ("pressure_a", "pressure_b", "torques"),
    [
        (FULL, FULL, (23.79, 10.17, -2.63)),
        (FULL, 0.0, (-0.89, -5.60, -10.75)),
        (0.0, FULL, (27.23, 16.87, 7.85)),
    ],
)
def test_torque_equals_the_expected_table(
    pressure_a: float, pressure_b: float, torques: tuple[float, ...]
) -> None:
    made = orthosis().torque(ANGLES, pressure_a, pressure_b)
    assert made == pytest.approx(torques, abs=0.02)


def test_stiffness_equals_the_expected_table() -> None:
    plant = orthosis()
    assert plant.stiffness(ANGLES, FULL, FULL) == pytest.approx((13.39, 12.61, 11.84), abs=6e-3)
    assert plant.stiffness(ANGLES, 0.0, 0.0) == pytest.approx((1.43, 1.35, 1.26), abs=6e-3)


@pytest.mark.parametrize("counts", COUNTS)
@pytest.mark.parametrize("pressures", [(0.0, 0.0), (FULL, 1e5), (2e5, 5e5)])
def test_the_stiffness_is_a_finite_difference_of_the_torque(
    counts: tuple[int, int], pressures: tuple[float, float]
) -> None:
    plant, h = orthosis(*counts), 1e-4
    rise = plant.torque(RANGE + h, *pressures) - plant.torque(RANGE - h, *pressures)
    assert np.abs(plant.stiffness(RANGE, *pressures) + rise / (2.0 * h)).max() < 1e-6


@pytest.mark.parametrize("counts", COUNTS)
def test_the_determinant_is_positive_over_the_whole_range(counts: tuple[int, int]) -> None:
    assert orthosis(*counts).determinant(RANGE).min() > 0.0


@pytest.mark.parametrize("counts", COUNTS)
def test_torque_and_stiffness_are_met_exactly(counts: tuple[int, int]) -> None:
    plant, drawn = orthosis(*counts), np.random.default_rng(1)
    q = drawn.uniform(RANGE[0], RANGE[-1], 200)
    p_a, p_b = drawn.uniform(0.0, FULL, (2, 200))
    made = plant.allocate(q, plant.torque(q, p_a, p_b), plant.stiffness(q, p_a, p_b))
    assert np.abs(np.array(made) - (p_a, p_b)).max() < 1e-9 * FULL
    desired = drawn.uniform(-20.0, 20.0, 200), drawn.uniform(1.0, 15.0, 200)
    x_a, x_b = plant.coefficients(*plant.allocate(q, *desired))
    shape_a, shape_b, slope_a, slope_b = plant.geometry(q)
    radius = plant.pulley.radius
    assert np.abs(radius * (shape_b * x_b - shape_a * x_a) - desired[0]).max() < 1e-9
    assert np.abs(-(radius**2) * (slope_a * x_a + slope_b * x_b) - desired[1]).max() < 1e-9


def test_plant_allocation_equals_that_of_the_allocation_module() -> None:
    plant, q = orthosis(), 0.9
    phi_a, phi_b, psi_a, psi_b = (float(v) for v in plant.geometry(q))
    radius = plant.pulley.radius
    factors = allocation.factors_for(4.0, 6.0, radius, phi_a, phi_b, psi_a, psi_b)
    made = [float(p) for p in plant.allocate(q, 4.0, 6.0)]
    assert made == pytest.approx([float(p) for p in plant.pressures_of(*factors)], rel=1e-9)
    area = radius**3 * allocation.determinant(phi_a, phi_b, psi_a, psi_b)
    assert float(plant.determinant(q)) == pytest.approx(area, rel=1e-12)


def test_feasible_set_is_a_parallelogram() -> None:
    plant = orthosis()
    torque, stiffness = plant.corners(np.radians([20.0, 60.0, 100.0]))
    assert torque[:, 0] + torque[:, 2] == pytest.approx(torque[:, 1] + torque[:, 3], abs=1e-9)
    assert stiffness[:, 0] + stiffness[:, 2] == pytest.approx(stiffness[:, 1] + stiffness[:, 3])


@pytest.mark.parametrize(("share", "area"), [(0.28, 105.0), (0.33, 138.0)])
def test_feasible_set_has_the_expected_area(share: float, area: float) -> None:
    """The 137 to 139 N2 m2/rad that were reckoned beforehand belong to C_max = 0.33 L_n."""
    ends = {f"bundle_{b}__largest_contraction": share for b in "ab"}
    torque, stiffness = orthosis(**ends).corners(np.radians([20.0, 60.0, 100.0]))
    side_a, side_b = torque[:, 1] - torque[:, 0], torque[:, 3] - torque[:, 0]
    up_a, up_b = stiffness[:, 1] - stiffness[:, 0], stiffness[:, 3] - stiffness[:, 0]
    assert side_b * up_a - side_a * up_b == pytest.approx([area] * 3, abs=1.1)


def test_equal_full_pressures_balance_near_107_degrees() -> None:
    plant, q = orthosis(), np.radians(np.linspace(90.0, 120.0, 3001))
    zero = q[np.argmin(np.abs(plant.torque(q, FULL, FULL)))]
    assert np.degrees(zero) == pytest.approx(107.0, abs=0.6)


@pytest.mark.parametrize("hysteresis", kinds())
def test_kernels_equal_the_numpy_statics(hysteresis: str) -> None:
    plant = ElbowOrthosis.paper(hysteresis, bundle_a__gain=1.1, link__mass=0.7)  # type: ignore[arg-type]
    fixed = plant.parameter_rows()[:, None].tolist()
    angle, lag = 0.7, 1.3e-3
    shapes, slopes = plant.geometry(angle)[:2], plant.geometry(angle)[2:]
    frictions = plant.friction(lag)
    for side, bundle in enumerate((plant.bundle_a, plant.bundle_b)):
        c = contraction_at(fixed, 0, side, angle)
        assert c == pytest.approx(float(plant.pulley.contractions(angle)[side]))
        made = shape_of(fixed, 0, side, c)
        assert made == pytest.approx((float(shapes[side]), float(slopes[side])))
        factors = (bundle.passive_factor, bundle.pressure_factor)
        assert factors_of(fixed, 0, side) == pytest.approx(factors)
        assert volume_of(fixed, 0, side, c) == pytest.approx(float(bundle.volume(c)), rel=1e-12)
        assert friction_of(fixed, 0, side, lag) == pytest.approx(float(frictions[side]))
    assert travel_at(fixed, 0, angle) == pytest.approx(float(plant.pulley.travel(angle)))
    assert weight_of(fixed, 0, angle) == pytest.approx(float(plant.weight_torque(angle)))


# --- hysteresis ----------------------------------------------------------------------------------


def forces_over_loop(plant: ElbowOrthosis, pressure: float) -> tuple[np.ndarray, np.ndarray]:
    """Force of bundle b over two sweeps of the whole range, and its contraction."""
    q = np.concatenate([RANGE, RANGE[::-1], RANGE, RANGE[::-1]])
    operator, travel = plant.hysteresis.operator, plant.pulley.travel(q)
    lag = travel - operator.simulate(travel)[0] if operator else np.zeros_like(q)
    contraction = plant.pulley.contractions(q)[1]
    shape = plant.bundle_b.shape(contraction) - plant.friction(lag)[1]
    n = 2 * len(RANGE)
    return (plant.bundle_b.factor(pressure) * shape)[n:], contraction[n:]


@pytest.mark.parametrize("hysteresis", ["maxwell_slip", "preisach"])
@pytest.mark.parametrize("pressure", [0.0, 5e5])
def test_loading_and_unloading_differ_by_the_published_share(
    hysteresis: str, pressure: float
) -> None:
    plant = ElbowOrthosis.paper(hysteresis)  # type: ignore[arg-type]
    force, contraction = forces_over_loop(plant, pressure)
    n = len(RANGE)
    shortening, lengthening = force[:n], force[n:][::-1]
    assert contraction[:n] == pytest.approx(contraction[n:][::-1])
    gap = lengthening - shortening
    assert gap.min() > -1e-9  # friction takes work
    full = float(plant.bundle_b.law(pressure, 0.0))
    assert 100.0 * gap.max() / full == pytest.approx(7.5, abs=0.01)


def width(kind: str, middle: float, swing: float) -> float:
    """Widest gap of a loop of the travel, over that of the widest loop there is."""
    hysteresis = elbow_hysteresis(kind)  # type: ignore[arg-type]
    up = middle + np.linspace(-swing, swing, 201)
    output = hysteresis.operator.simulate(np.concatenate([up, up[::-1]] * 3))[0]  # type: ignore[union-attr]
    rise, fall = output[-402:-201], output[-201:][::-1]
    return float(np.abs(fall - rise).max()) / (2.0 * hysteresis.largest_lag)


def test_hysteresis_models_agree_only_in_their_widest_loop() -> None:
    for kind in ("maxwell_slip", "preisach"):
        assert width(kind, 0.0, 0.033) == pytest.approx(1.0, abs=1e-3)
    plays = [width("maxwell_slip", place, 0.01) for place in (0.0, 0.02)]
    relays = [width("preisach", place, 0.01) for place in (0.0, 0.02)]
    assert plays[0] == pytest.approx(plays[1], rel=1e-6)  # plays know nothing of where they are
    assert relays[0] < 0.5 * relays[1]
    assert relays[0] < 0.5 * plays[0]


def test_relays_follow_the_travel_in_one_direction() -> None:
    """Their slope is 1 on the mean of both branches, so that the lag is the same either way."""
    relays = elbow_hysteresis("preisach").operator
    x = np.linspace(-0.033, 0.033, 67)
    around = np.concatenate([x, x[::-1], x, x[::-1]])
    output = relays.simulate(around)[0]  # type: ignore[union-attr]
    rise, fall = output[134:201], output[201:][::-1]
    inside = np.abs(x) < 0.017  # where all relays have come over
    assert 0.5 * (rise + fall)[inside] == pytest.approx(x[inside], abs=2e-4)


def test_plays_and_relays_have_the_same_largest_lag() -> None:
    wide = Preisach.resembling(travel_plays(), -0.06, 0.06, 121, start="virgin")
    lag = elbow_hysteresis("maxwell_slip").largest_lag
    assert ElbowHysteresis(wide).largest_lag == pytest.approx(lag, rel=1e-9)


# --- bad values, files ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"bundle_a__muscles": 2.5}, "whole number"),
        ({"bundle_b__muscles": 0.0}, "outside its bounds"),
        ({"pulley__radius": 0.06}, "smaller radius"),
        ({"pulley__highest": 0.2, "pulley__lowest": 0.3}, "swap"),
        ({"link__inertia": 1e-4, "wearer__inertia": 5e-3, "wearer__damping": 20.0}, "too fast"),
    ],
)
def test_bad_values_are_refused_with_a_remedy(changes: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ElbowOrthosis.paper(**changes)  # type: ignore[arg-type]


def test_unknown_valve_types_and_hysteresis_models_are_refused() -> None:
    with pytest.raises(ValueError, match="valves = 'pulsed'"):
        ElbowOrthosis.paper(valves="pulsed")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="hysteresis = 'dahl'"):
        ElbowOrthosis.paper("dahl")  # type: ignore[arg-type]
    plays = travel_plays()
    steep = dataclasses.replace(plays, linear=0.5)
    many = dataclasses.replace(
        plays, thresholds=tuple(0.001 * k for k in range(1, 14)), weights=(0.06,) * 13
    )
    for operator, words in ((steep, "total slope"), (many, "at most 12")):
        with pytest.raises(ValueError, match=words):
            ElbowOrthosis.paper().replace({"hysteresis.operator": operator})
    relays = elbow_hysteresis("preisach").operator
    with pytest.raises(ValueError, match="virgin"):
        ElbowOrthosis.paper().replace(
            {"hysteresis.operator": dataclasses.replace(relays, start="low")}  # type: ignore[type-var]
        )


def test_valves_have_the_published_cycle_and_supply() -> None:
    assert ElbowOrthosis.paper().cycle == pytest.approx(0.05)
    assert ElbowOrthosis.paper(valves="on_off", valve__supply_pressure=5e5).full_pressure == 5e5
