"""Selection of the kind of regulator by the pressure alone, beside effects of its valve."""

import numpy as np
import pytest

from pam_envs.diagnosis.causes import by_name, catalogue
from pam_envs.diagnosis.fit.blocks import Blocks
from pam_envs.diagnosis.fit.least_squares import Problem
from pam_envs.diagnosis.fit.regulator_kind import Selection
from pam_envs.diagnosis.fit.single_muscle import MuscleFamily
from tests.diagnosis.conftest import needs_kernels

NOISE = np.array([5e-5, 1e3])
FILLS = {"regulator.time_constant": 0.06}

pytestmark = needs_kernels


def selected(family: MuscleFamily, values: dict[str, float]) -> tuple[MuscleFamily, list[str]]:
    """Return the family selected on readings of the plant with some values, and the effects."""
    rig = MuscleFamily(
        family.plant.replace_with_substeps(FILLS | values), family.inputs, family.clock
    ).finer(0.0026)
    clean = rig.simulate(rig.column[None])[:, :, 0]
    readings = clean + NOISE[:, None] * np.random.default_rng(5).standard_normal(clean.shape)
    time = np.arange(clean.shape[1]) * family.inputs.period
    blocks = Blocks.make(time, readings)
    problem = Problem(family.simulate, readings, NOISE, blocks.train, time, family.tie)
    causes = [cause for cause in catalogue() if not cause.common]
    limit = by_name("slew_limit")
    found, _, shown = Selection(problem, family, blocks, limit, causes, lambda _: {}).selected()
    return found, list(shown)


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ({}, ""),
        ({"regulator.speed_2": 0.8, "regulator.speed_6": 0.6, "regulator.speed_20": 0.4}, "speed"),
        ({"regulator.integral": 60.0, "regulator.integral_release": 1.0}, "integral"),
        ({"regulator.flow": 1.0, "regulator.opening_bend": 0.5}, "flow"),
        (
            {
                **{"regulator.flow": 1.0, "regulator.opening_integral": 4.0},
                **{"regulator.opening_windup": 0.2, "regulator.opening_lag": 0.015},
            },
            "integrating flow",
        ),
    ],
)
def test_it_finds_the_kind(family: MuscleFamily, values: dict[str, float], kind: str) -> None:
    found, shown = selected(family, values)
    air = found.plant.regulator
    kinds = {
        "speed": air.speed_20 != 1.0,
        "integral": air.integral > 0.0,
        "flow": air.flow > 0.0 and air.opening_integral == 0.0,
        "integrating flow": air.flow > 0.0 and air.opening_integral > 0.0,
    }
    assert [name for name, on in kinds.items() if on] == [kind][: bool(kind)]
    assert shown == []


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"regulator.exhaust_ratio": 1.5}, "exhaust_asymmetry"),
        ({"regulator.overlap": 8e3}, "valve_dead_band"),
        ({"regulator.dead_time": 0.09}, "dead_time"),
    ],
)
def test_an_effect_leads_to_no_other_kind(
    family: MuscleFamily, values: dict[str, float], name: str
) -> None:
    found, shown = selected(family, values)
    air = found.plant.regulator
    assert (air.speed_20, air.integral, air.flow, air.ring_share) == (1.0, 0.0, 0.0, 0.0)
    assert shown == [name]
