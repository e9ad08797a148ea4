"""Diagnose model error from a recording; extend the plant; quantify the improvement."""

from typing import Any

__all__ = ["Diagnosis", "Quantity", "Simulator", "diagnose", "diagnose_readings"]

_HOMES = {
    "Diagnosis": "pam_envs.diagnosis.report.outcome",
    "Quantity": "pam_envs.diagnosis.families.simulator",
    "Simulator": "pam_envs.diagnosis.families.simulator",
    "diagnose": "pam_envs.diagnosis.diagnosis",
    "diagnose_readings": "pam_envs.diagnosis.static.diagnosis",
}


def __getattr__(name: str) -> Any:
    """Return a public name, imported on first use."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)
