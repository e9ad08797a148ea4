"""``Own/SpringMuscle-v0``: hold a muscle's contraction against a spring.

Observation: contraction [m], pressure [Pa], reference [m] and its preview. Action: setpoint of the
pressure [Pa]. Reward: ``-|contraction - reference| / 1 mm``. Start: at rest without pressure. End:
truncated after ``episode_seconds``; terminated when the contraction exceeds 30 mm.
"""

import hashlib
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pam_envs.envs.core.arguments import (
    Common,
    Randomization,
    environment_arguments,
    environments,
)
from pam_envs.envs.core.families import Kernels
from pam_envs.envs.core.kernels import report_tracking
from pam_envs.envs.core.layout import Report, computed, indices
from pam_envs.envs.core.setup import Setup, compose
from pam_envs.envs.core.step import CHOICE, FIRST_CONFIG, KEY_A, KEY_B, PERIOD
from pam_envs.kernels.build import LANES, kernel, routine
from pam_envs.parameters import assumed
from pam_envs.references.trajectory import FAMILIES, ROWS, SAMPLES, draw_reference, sines_needed
from pam_envs.tasks.rewards import weight

PRESSURE, CONTRACTION, SET_POINT, OLD_SET_POINT, REFERENCE = range(5)
LAG, GAIN = range(2)
REPORT = Report(
    {
        **computed("reward", "tracking"),
        **computed("margin", "contraction"),
        **computed("cost", "contraction"),
        **computed("effort", "pressure_travel", "air"),
        "state/contraction": CONTRACTION,
        "state/pressure": PRESSURE,
    },
    scratch=0,
    observed=(CONTRACTION, PRESSURE),
)
INFO, ENDED, SIGNALS = REPORT.rows, REPORT.ended, REPORT.signals
LONGEST, FULL = 0.03, 6e5


@dataclass(frozen=True)
class Holding:
    """Weight and scale of the reward."""

    tracking_weight: float = weight(1.0, "reward per control period at an error of error_scale")
    error_scale: float = assumed(1e-3, "m", 1e-6, 1.0, "an error of 1 mm costs 1")


CONFIG = indices(("tracking_weight", "error_scale"), FIRST_CONFIG)


@dataclass(frozen=True)
class Muscle:
    """First-order pressure, and a contraction proportional to it."""

    lag: float = assumed(0.1, "s", 0.01, 1.0, "of the regulator", spread=(0.05, 0.2))
    gain: float = assumed(4e-8, "m/Pa", 1e-9, 1e-6, "of muscle and spring")
    family, control_period, substeps = "spring_muscle", 0.01, 1

    @property
    def muscle(self) -> "Muscle":
        """Component of the parameters' names."""
        return self

    def needs_effects(self, spread: Any) -> bool:
        """Return whether the extended step is needed: there is none."""
        return False

    def hysteresis_tables(self) -> NDArray[np.float64]:
        """Return the tables of hysteresis: there is none."""
        return np.zeros((1, 1, 1))

    def members(self) -> "tuple[Muscle, ...]":
        """Return the equally good fits: this one."""
        return (self,)

    def replace(self, changes: dict[str, float]) -> "Muscle":
        """Return a muscle with other parameters."""
        named = {name.partition(".")[2]: value for name, value in changes.items()}
        return Muscle(**{"lag": self.lag, "gain": self.gain, **named})

    def parameter_rows(self) -> NDArray[np.float64]:
        """Return the parameters in the order of the kernels' rows."""
        return np.array(astuple(self))

    def digest(self) -> str:
        """Return a hash of the parameters."""
        return hashlib.sha256(self.parameter_rows().tobytes()).hexdigest()


@kernel
def advance(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any,
) -> None:  # fmt: skip
    """Advance pressure and contraction by a control period (implicit Euler)."""
    for j in range(LANES):
        share = settings[0][PERIOD] / (settings[0][PERIOD] + fixed[LAG][j])
        rows[PRESSURE][j] += share * (rows[SET_POINT][j] - rows[PRESSURE][j])
        rows[CONTRACTION][j] = fixed[GAIN][j] * rows[PRESSURE][j]


@kernel
def evaluate(rows: Any, fixed: Any, counts: Any, settings: Any, choices: Any, work: Any) -> None:
    """Write rewards, costs and margins of a tile into ``work``."""
    config, reference = settings[0], work[SIGNALS + choices[CHOICE.fixed]]
    for j in range(LANES):
        output = rows[CONTRACTION][j]
        report_tracking(work, config, INFO, CONFIG, reference[j], output, j)
        work[INFO.margin_contraction][j] = LONGEST - output
        work[INFO.cost_contraction][j] = 0.0
        travel = abs(rows[SET_POINT][j] - rows[OLD_SET_POINT][j])
        work[INFO.effort_pressure_travel][j], work[INFO.effort_air][j] = travel, 0.0
        work[ENDED][j] = 1.0 if output > LONGEST else 0.0


@routine
def begin(
    rows: Any, fixed: Any, counts: Any, tables: Any, samples: Any, settings: Any, choices: Any,
    work: Any, j: int,
) -> None:  # fmt: skip
    """Bring lane ``j`` to rest without pressure, and draw its reference."""
    for k in range(REFERENCE):
        rows[k][j] = 0.0
    family = choices[CHOICE.reference]
    if family != SAMPLES:
        draw_reference(rows, REFERENCE, j, counts[KEY_A][j], counts[KEY_B][j], family, 0.005, 0.02)


def kernels() -> Kernels:
    """Return the kernels."""
    return Kernels(
        "spring_muscle",
        kernels,
        (),
        REPORT,
        evaluate,
        begin,
        rows=REFERENCE + ROWS,
        parameters=2,
        counts=5,
        set_points=SET_POINT,
        old_set_points=OLD_SET_POINT,
        config=CONFIG,
        advance=advance,
        placeholders={"FIRST_REFERENCE": REFERENCE},
    )


@environment_arguments(reference="steps", preview=2, preview_stride=5, episode_seconds=5.0)
def make_setup(given: Common) -> Setup:
    """Return the checked configuration."""
    plant = given.plant or Muscle()
    family, samples = given.reference_of(FAMILIES, "m", LONGEST)
    span = ("m", 0.0, LONGEST)
    pressure = ("Pa", 0.0, FULL)
    drawn = Randomization(("muscle.lag", "muscle.gain"), (), "{'muscle.lag': (0.05, 0.2)}")
    return compose(
        plant,
        lambda effects: kernels(),
        given,
        drawn,
        observation=[("contraction", *span), ("pressure", *pressure)],
        references=[("reference", *span)],
        action=[("pressure_set_point", *pressure)],
        config=vars(given.task_of(Holding)),
        reference=family,
        sines=sines_needed(family),
        samples=samples,
        view=f"{__package__}.view:VIEW",
    )


SpringMuscleEnv, SpringMuscleVectorEnv = environments("SpringMuscle", make_setup)
