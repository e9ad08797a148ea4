"""Regression of the force balance."""

import numpy as np
import pytest

from pam_envs.arrays import Array
from pam_envs.diagnosis.fit.balance import Balance
from pam_envs.diagnosis.fit.single_muscle import MuscleFamily
from pam_envs.muscle.effects import MAP_TERMS
from tests.diagnosis.conftest import needs_kernels

NOISE = 5e-5

pytestmark = needs_kernels


def balance(family: MuscleFamily, **values: float) -> Balance:
    """Return the balance of readings of the plant with some values, without noise."""
    column = family.column.copy()
    for name, value in values.items():
        column[family.free(name.replace("__", ".")).place] = value
    columns = column[None]
    family.tie(columns)
    contraction, pressure = family.simulate(columns)[:, :, 0]
    found = Balance.of(family, contraction, pressure, NOISE)
    assert found is not None
    return found


def force(family: MuscleFamily, found: dict[str, float], pressure: Array, strain: Array) -> Array:
    """Return the force of a static law and its map with found coefficients [N]."""
    law = family.plant.muscle
    area = found["muscle.area"]
    taper = found["muscle.area_taper"] * strain + found["muscle.area_curve"] * strain**2
    passive = found["muscle.braid_force"] * -np.expm1(-strain / found["muscle.braid_strain"])
    names = ("stiffness", "softening", "hardening", "stiffening")
    passive += sum(found[f"muscle.{name}"] * strain ** (k + 1) for k, name in enumerate(names))
    terms = np.zeros((6, 6))
    for i, j in MAP_TERMS:
        terms[i, j] = found[f"muscle.map_{i}{j}"]
    u = np.clip(2.0 * pressure / law.map_pressure - 1.0, -1.0, 1.0)
    s = np.clip(2.0 * strain / law.map_strain - 1.0, -1.0, 1.0)
    mapped = np.polynomial.chebyshev.chebval2d(u, s, terms)
    return np.asarray(area * pressure * (1.0 - taper) - passive + mapped)


def test_it_finds_the_static_law(family: MuscleFamily) -> None:
    larger = 1.2 * family.plant.muscle.area
    found = balance(family, muscle__area=larger).solve()
    assert found["muscle.area"] == pytest.approx(larger, rel=0.03)


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ({"hysteresis__yield_width": 3e4, "hysteresis__yield_break": 3e4}, "hysteresis.yield_"),
        ({"muscle__yield_force": 8.0, "muscle__yield_break": 0.03}, "muscle.yield_"),
        (
            {"muscle__strand_1": 4.0, "muscle__strand_3": 4.0, "muscle__strand_break": 0.03},
            "muscle.strand_",
        ),
    ],
)
def test_it_finds_friction_of_each_kind(
    family: MuscleFamily, values: dict[str, float], kind: str
) -> None:
    made = balance(family, **values)
    found = made.flexible()
    sizes = {
        "hysteresis.yield_": found.get("hysteresis.yield_width", 0.0) * found["muscle.area"],
        "muscle.yield_": found.get("muscle.yield_force", 0.0),
        "muscle.strand_": sum(found.get(f"muscle.strand_{k}", 0.0) for k in (1, 2, 3, 4)),
    }
    assert max(sizes, key=lambda name: sizes[name]) == kind
    assert sizes[kind] > 0.25 * values[next(iter(values))] * (
        found["muscle.area"] if kind == "hysteresis.yield_" else 1.0
    )
    moved = misread(family, made, found, plant_force(family, made))
    assert np.std(moved) < 2.0 * NOISE  # plays may take a part of the friction, and the law of it


def test_other_friction_is_of_one_kind(family: MuscleFamily) -> None:
    made = balance(family, muscle__yield_force=8.0, muscle__yield_break=0.03)
    prefixes = {
        "strands": "muscle.strand_",
        "length": "muscle.yield_",
        "pressure": "hysteresis.yield_",
    }
    chosen = [friction.kind for friction in made._finer[1]]
    found = [
        {kind for kind, prefix in prefixes.items() if any(n.startswith(prefix) for n in other)}
        for other in made.others()
    ]
    left = [kind for kind in prefixes if chosen != [kind]]
    assert len(found) == len(left) >= 2
    assert all(kinds <= {kind} for kinds, kind in zip(found, left, strict=True))


def plant_force(family: MuscleFamily, made: Balance) -> Array:
    """Return the force of the plant's static law at the samples of a balance [N]."""
    return np.asarray(family.plant.muscle.tension(made.pressure, made.strain))


def misread(family: MuscleFamily, made: Balance, found: dict[str, float], true: Array) -> Array:
    """Return the error of a found law as one of the contraction [m], without its mean."""
    off = force(family, found, made.pressure, made.strain) - true
    moved = off * family.plant.muscle.rest_length / made._plain[2]
    return np.asarray(moved - moved.mean())


def test_the_map_explains_a_law_of_another_shape(family: MuscleFamily) -> None:
    changed = balance(family, muscle__map_22=30.0)
    plain, finer = (part[0].error / len(changed.rows) for part in (changed._plain, changed._finer))
    assert plain > 1.0  # mean square over that of the noise, of readings without noise
    assert finer < 0.2 * plain


def test_too_few_slow_samples_give_no_balance(family: MuscleFamily) -> None:
    few = np.full(len(family.inputs.load), np.nan)
    few[:100] = 0.0
    assert Balance.of(family, few, np.zeros(len(few)), NOISE) is None
