"""Identification of a mass-spring-damper by ``mujoco.sysid`` (extra ``mujoco``).

It is given the mechanism, the force, and our bounds and starting values. Issues are the warnings of
its own report.
"""

import importlib.metadata
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.head_to_head.mass_spring_damper import PARAMETERS
from pam_envs.arrays import Array

STEP = 0.005  # step of MuJoCo's simulation [s]
MECHANISM = Path(__file__).with_name("mechanism.xml")
LOSS = ("friction.force", 0.5)  # our name of MuJoCo's dry friction, and its starting value [N]


@dataclass(frozen=True)
class Identified:
    """Result of an identification; parameters by our names [SI]."""

    values: dict[str, float]
    intervals: dict[str, float]  # half-widths of 95 % intervals
    issues: list[str]  # warnings of its report
    position: Array  # of the fitted model [m], shape (T,), NaN where it is not compared


def version() -> str | None:
    """Return MuJoCo's version if its identification is available, else None."""
    try:
        from mujoco import sysid

        assert hasattr(sysid, "optimize")
        return importlib.metadata.version("mujoco")
    except (ImportError, AttributeError):
        return None


def identify(
    force: Array, reading: Array, period: float, start: dict[str, float], friction: bool
) -> Identified:
    """Fit mass, stiffness and damping, and optionally dry friction, to positions [m]."""
    import mujoco
    from mujoco import sysid
    from mujoco.sysid.report.sections.insights import AutomatedInsights

    spec = mujoco.MjSpec.from_string(MECHANISM.read_text(encoding="utf-8").format(step=STEP))
    parameters = _parameters(start | ({LOSS[0]: LOSS[1]} if friction else {}))
    sequence = _sequence(spec, force, reading, period)
    residual = sysid.build_residual_fn(models_sequences=[sequence], n_threads=1)
    with redirect_stdout(StringIO()):  # it prints iterations despite verbose=False
        found, result = sysid.optimize(parameters, residual, optimizer="mujoco", verbose=False)
    left, (predicted,), _ = residual(found.as_vector(), found, return_pred_all=True)
    _, widths = sysid.calculate_intervals(left, result.jac)
    names = found.get_non_frozen_parameter_names()
    position = np.full(len(force), np.nan)
    position[np.round(predicted[0].times / period).astype(int)] = predicted[0].data[:, 0]
    insights = AutomatedInsights("insights", found).get_context()["insights"]
    return Identified(
        dict(zip(names, found.as_vector().tolist(), strict=True)),
        dict(zip(names, np.asarray(widths).tolist(), strict=True)),
        [f"{i['title']}: {i['message']}" for i in insights if i["type"] == "warning"],
        position,
    )


def _parameters(start: dict[str, float]) -> Any:
    """Return the fitted parameters with their changes of the mechanism."""
    from mujoco import sysid

    def modifier(name: str) -> Any:
        def modify(spec: Any, parameter: Any) -> None:
            value = float(parameter.value[0])
            if name == "mass":
                spec.body("mass").mass = value
            elif name == LOSS[0]:
                spec.joint("slide").frictionloss = value
            else:
                field = getattr(spec.joint("slide"), name)
                field[0] = value

        return modify

    made = sysid.ParameterDict()
    for name, value in start.items():
        _, low, high, _ = PARAMETERS[name]
        made.add(sysid.Parameter(name, value, low, high, modifier=modifier(name)))
    return made


def _sequence(spec: Any, force: Array, reading: Array, period: float) -> Any:
    """Return the recording for ``mujoco.sysid``, with the force at each simulation step."""
    from mujoco import sysid

    model, each = spec.compile(), round(period / STEP)
    times = np.arange(len(force)) * period
    finely = np.arange((len(force) - 1) * each + 1) * STEP
    held = np.repeat(force, each)[: len(finely), None]
    # the state, not the sensor: a sensor is read before a step but stamped with the time after it
    shown = sysid.TimeSeries.from_names(times, reading[:, None], model, ["slide_qpos"])
    pushed = sysid.TimeSeries.from_control_names(finely, held, model)
    rest = sysid.create_initial_state(model, np.zeros(1))
    return sysid.ModelSequences("rig", spec, "campaign", rest, pushed, shown)


def predict(values: dict[str, float], force: Array, period: float) -> Array:
    """Return the positions [m], shape (T,), of a model with given parameters under a force."""
    import mujoco

    spec = mujoco.MjSpec.from_string(MECHANISM.read_text(encoding="utf-8").format(step=STEP))
    for parameter in _parameters(values).values():
        parameter.apply_modifier(spec)
    model = spec.compile()
    data, found = mujoco.MjData(model), np.empty(len(force))
    for k, value in enumerate(force):
        found[k] = data.qpos[0]
        data.ctrl[0] = value
        mujoco.mj_step(model, data, nstep=round(period / STEP))
    return found
