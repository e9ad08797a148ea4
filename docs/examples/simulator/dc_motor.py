"""Diagnosis of any simulation: a DC motor that turns a lever against a spring.

    J phi'' = K u(t - T) - D phi' - C phi - friction

The simulation knows neither the friction nor the dead time T. The recording comes from a motor that
has one of them: ``python dc_motor.py friction`` or ``dead_time``.
"""

import sys

import numpy as np
from numba import njit

from pam_envs.data.recording.channels import Channel
from pam_envs.diagnosis import Diagnosis, Quantity, Simulator, diagnose
from pam_envs.diagnosis.cause import Cause, Form, Term

SUBSTEPS = 10


@njit
def turn(voltage, period, gain, damping, spring, friction, dead_time):
    """Return the angle [rad] at the beginning of each period, from rest."""
    angles, h = np.empty(len(voltage)), period / SUBSTEPS
    angle, speed = 0.0, 0.0
    for k in range(len(voltage)):
        angles[k] = angle
        for i in range(SUBSTEPS):
            past = max(0.0, k + i / SUBSTEPS - dead_time / period)  # in sampling periods
            now, soon = int(past), min(int(past + 1.0 / SUBSTEPS), k)
            share = max(0.0, (past + 1.0 / SUBSTEPS - soon) * SUBSTEPS) if soon > now else 0.0
            u = voltage[now] + share * (voltage[soon] - voltage[now])  # mean over the step
            push = gain * u - spring * angle - damping * speed
            speed += h * push
            lost = min(abs(speed), h * friction)  # friction stops, but never drives
            speed -= np.sign(speed) * lost
            angle += h * speed
    return angles


def simulate(parameters, inputs, period):
    """Return the outputs of the motor by name."""
    return {"angle": turn(inputs["voltage"], period, **parameters)}


VOLTAGE, ANGLE = Channel("voltage", unit="V"), Channel("angle", unit="deg", scale=np.pi / 180)
MOTOR = Simulator(
    simulate,
    parameters={
        "gain": Quantity(30.0, "rad/(s2 V)", 1.0, 500.0, log=True),
        "damping": Quantity(5.0, "1/s", 0.1, 100.0, log=True),
        "spring": Quantity(60.0, "1/s2", 1.0, 1000.0, log=True),
        "friction": Quantity(0.0, "rad/s2", 0.0, 100.0, effect=True, scale=0.5),
        "dead_time": Quantity(0.0, "s", 0.0, 0.2, effect=True, scale=0.005),
    },
    inputs=(VOLTAGE,),
    outputs=(ANGLE,),
    causes=(
        Cause("friction", "dry friction", (Form("Coulomb", (Term("friction", (1.0, 5.0)),)),)),
        Cause("dead_time", "a dead time", (Form("delay", (Term("dead_time", (0.01, 0.04)),)),)),
    ),
    name="dc_motor",
)
HIDDEN = {"friction": {"friction": 4.0}, "dead_time": {"dead_time": 0.03}, "nothing": {}}


def found(hidden: str, seconds: float = 90.0, period: float = 0.02) -> Diagnosis:
    """Record a motor with a hidden effect, and diagnose the simulation."""
    random, n = np.random.default_rng(1), round(seconds / period)
    time = period * np.arange(n)
    levels = np.repeat(random.uniform(-1.0, 1.0, n // 150 + 1), 150)[:n]
    voltage = 5.0 * np.where(time < seconds / 2, levels, np.sin(time + 0.02 * time**2))
    voltage[:250] = 0.0
    rig = MOTOR.replace({"gain": 36.0, "damping": 6.0, "spring": 55.0, **HIDDEN[hidden]})
    angle = rig.run({"voltage": voltage}, period)["angle"] + random.normal(0.0, 2e-3, n)
    recording = MOTOR.record(time, {"voltage": voltage}, {"angle": angle})
    return diagnose(recording, MOTOR, progress=False)


if __name__ == "__main__":
    result = found(sys.argv[1] if len(sys.argv) > 1 else "friction")
    print(result.verdict, result.causes)
    print(result.text)
    result.write("found")
