"""Keyword arguments that reach the branches of muscle positioning."""

from typing import Any

from pam_envs.plants.single_muscle.plant import SingleMuscle

EVERY_EFFECT = {
    "regulator.gain": 0.97,
    "regulator.slew_bend": 0.5,
    "regulator.dead_band": 2e3,
    "regulator.dead_close": 0.4,
    "regulator.overlap": 1e3,
    "regulator.overlap_leak": 0.02,
    "regulator.exhaust_ratio": 1.3,
    "regulator.exhaust_taper": 0.5,
    "regulator.speed_2": 0.8,
    "regulator.speed_60": 0.6,
    "regulator.integral": 20.0,
    "regulator.exhaust_rate": 8.0,
    "regulator.leak": 0.02,
    "regulator.supply_pressure": 6.3e5,
    "regulator.supply_droop": 0.2,
    "regulator.supply_time": 0.08,
    "regulator.ring_share": 0.1,
    "regulator.ring_flow": 0.05,
    "hysteresis.shape": 1.3,
    "hysteresis.pressure_slope": 0.2,
    "hysteresis.pressure_bend": -0.1,
    "hysteresis.creep_1": 0.02,
    "hysteresis.first_width": 0.2,
    "hysteresis.first_loss": 0.01,
    "hysteresis.first_stiffness": 30.0,
    "hysteresis.threshold": 5e3,
    "hysteresis.start": -0.5,
    "muscle.area_curve": 0.5,
    "muscle.temperature": 300.0,
    "muscle.temperature_gain": 0.002,
    "muscle.load_curve": 2.0,
    "muscle.load_stiffening": 1e-3,
    "muscle.load_stiffening_root": 2e-3,
    "muscle.creep_2": 0.02,
    "muscle.strand_2": 3.0,
    "muscle.strand_4": 2.0,
    "muscle.viscosity": 200.0,
    "muscle.viscosity_per_pressure": 1e-3,
    "muscle.viscosity_relaxing": 0.5,
    "mass.load_error": 0.1,
    "mass.slack": 1e-3,
    "mass.slack_free": 0.2,
    "mass.slack_sag": 0.4,
    "mass.stick": 3.0,
    "mass.ring_share": 0.05,
    "position.drift": 1e-6,
    "position.ramp": 1e-4,
    "position.delay": 0.013,
    "position.bow": 0.01,
    "position.wave": 0.01,
    "position.cycle_sine": 2e-5,
    "position.cycle_cosine": -3e-5,
    "position.cycle_time": 20.0,
    "position.slip": 1e-4,
    "position.slip_at": 0.3,
    "pressure.drift": 10.0,
    "pressure.bow": 0.01,
    "pressure.wave": 0.01,
    "pressure.cycle_cosine": 200.0,
}
"""Every effect at once."""

OWN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/MusclePositioning-v0": {
        "preisach": {"hysteresis": "preisach"},
        "preisach_random": {"hysteresis": "preisach", "randomize": True, "preview": 0},
        "loads": {
            "randomize": True,
            "load": None,
            "reference": "mixed",
            "load_disturbance": 1.0,
        },
        "effects": {"plant": SingleMuscle.mas10("maxwell_slip").replace(EVERY_EFFECT)},
        "staircase": {"hysteresis": "preisach", "randomize": True, "reference": "staircase"},
        "samples": {
            "reference": [0.001 * (k // 20 % 13) for k in range(300)],
            "preview": 3,
            "preview_stride": 2,
        },
    },
}
PLAIN: dict[str, dict[str, dict[str, Any]]] = {
    "PAM/MusclePositioning-v0": {"none": {"hysteresis": "none", "normalize": False}},
}
LIVELY: dict[str, dict[str, Any]] = {"PAM/MusclePositioning-v0": {"load": None}}
