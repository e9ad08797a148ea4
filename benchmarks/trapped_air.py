"""Trapped air of a joint whose valves are shut, beside the record of such a joint."""

from typing import Any

import numpy as np

from pam_envs.arrays import Array
from pam_envs.constants import ATMOSPHERE
from pam_envs.data.stick_slip import MUSCLE_LENGTH, load_stick_slip, log_slopes
from pam_envs.plants.antagonistic_joint.plant import AntagonisticJoint
from pam_envs.plants.antagonistic_joint.rollout import simulate_joint

CONTRACTION = 0.1
"""Contraction of both muscles at the middle: assumed, the record does not have it."""
EXPONENTS = (1.0, 1.2, 1.4)
"""Isothermal, between, adiabatic."""
REST, SHUT = 100, 400
"""Control periods at the record's mean pressure, and with both valves shut."""
PULL = 0.5
"""Amplitude of the torque that turns the joint [N m]."""


def shut_joint(exponent: float) -> AntagonisticJoint:
    """Return a joint with muscles of the record's length and flow of their air.

    Without hysteresis, weight and imbalance, so that only air and law resist.
    """
    joint = AntagonisticJoint.measured(
        "none", muscle__rest_length=MUSCLE_LENGTH, link__limit=0.1, link__gravity=0.0
    )
    middle = float(joint.lever.contraction(0.0, MUSCLE_LENGTH)[0])
    fittings = joint.lever.fittings + (CONTRACTION - middle) * MUSCLE_LENGTH
    air = {"regulator.flow": 1.0, "regulator.polytropic": exponent}
    return joint.replace({"lever.fittings": fittings} | air)


def trapped_air(exponent: float) -> tuple[Array, Array]:
    """Return displacement [m], shape (T,), and pressures of both muscles [Pa], (2, T).

    The air is compressed with this exponent; positive displacements shorten muscle A, whose
    pressure falls, as muscle 1's of the record.
    """
    record, joint = load_stick_slip(), shut_joint(exponent)
    time = np.arange(REST + SHUT) * joint.control_period
    valve = np.where(time < REST * joint.control_period, 1.0, -1.0)
    pull = np.where(valve < 0.0, PULL * np.sin(2.0 * np.pi * time), 0.0)
    held = [np.where(valve > 0.0, p.mean(), -1.0) for p in record.pressures]
    made = simulate_joint(joint, disturbance=pull, pressures=(held[0], held[1]), compiled=False)
    shortened = MUSCLE_LENGTH * (made["contraction_a"] - made["contraction_b"]) / 2.0
    pressures = np.array([made["pressure_a"], made["pressure_b"]])
    settled = REST + 10  # the dead time is over
    return shortened[settled:], pressures[:, settled:]


def trapped_air_figure() -> Any:
    """Return pressure over displacement with shut valves, measured and of the joint."""
    from matplotlib.figure import Figure

    record = load_stick_slip()
    figure = Figure(figsize=(9.5, 4.0), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    models = {exponent: trapped_air(exponent) for exponent in EXPONENTS}
    for muscle, ax in enumerate(panels):
        middle = record.pressures[muscle].mean()
        x = record.displacement - record.displacement.mean()
        slope = record.trapped_slopes()[muscle]
        ax.plot(
            1e3 * x, 1e-3 * record.pressures[muscle], color="0.6", linewidth=1.0,
            label=f"measured, {slope:+.1f} per metre",
        )  # fmt: skip
        for k, (exponent, (moved, pressures)) in enumerate(models.items()):
            slope = log_slopes(moved, pressures)[muscle]
            near = 1e-3 * np.array([-0.7, 0.7])
            line = (middle + ATMOSPHERE) * np.exp(slope * near) - ATMOSPHERE
            ax.plot(
                1e3 * near, 1e-3 * line, color=f"C{k}", linewidth=1.4,
                label=f"model, n = {exponent:g}: {slope:+.1f} per metre",
            )  # fmt: skip
        ax.set_title(f"muscle {muscle + 1}")
        ax.set_xlabel("displacement from the middle [mm]")
        ax.spines[["top", "right"]].set_visible(False)
        ax.legend(frameon=False, fontsize=8)
    panels[0].set_ylabel("gauge pressure [kPa]")
    figure.suptitle(
        "Trapped air of an antagonistic pair, valves shut; slopes of the log of absolute pressure"
    )
    return figure
