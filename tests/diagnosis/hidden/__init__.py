"""Rigs that hide an effect in their recordings, independent of the library under test.

Nothing here imports the library's plants: muscle law, friction, integrator and the mathematical
form of every effect are others. `catalogue` compares the forms.
"""

from .base import CONTRACTION_NOISE_MM, PRESSURE_NOISE_BAR, Base, draw_base
from .campaign import (
    Campaign,
    campaign_idle,
    campaign_long,
    campaign_short,
    campaign_standard,
)
from .catalogue import EFFECTS, FINAL_UNKNOWN, TUNING_UNKNOWN, draw_effect
from .effect import Effect
from .rig import make_recording, rig_yaml, simulate, write_csv
from .stepper import Stepper

__all__ = [
    "CONTRACTION_NOISE_MM",
    "EFFECTS",
    "FINAL_UNKNOWN",
    "PRESSURE_NOISE_BAR",
    "TUNING_UNKNOWN",
    "Base",
    "Campaign",
    "Effect",
    "Stepper",
    "campaign_idle",
    "campaign_long",
    "campaign_short",
    "campaign_standard",
    "draw_base",
    "draw_effect",
    "make_recording",
    "rig_yaml",
    "simulate",
    "write_csv",
]
