"""Twenty-one simulated worlds of a laboratory rig: one muscle, a hanging load, a regulator."""

from .forms import Effect
from .names import EFFECTS, OUTSIDE, WORLDS
from .rig import Rig, draw_rig, truth_of
from .run import make_recording, simulate
from .scaling import draw_effect

__all__ = [
    "EFFECTS",
    "OUTSIDE",
    "WORLDS",
    "Effect",
    "Rig",
    "draw_effect",
    "draw_rig",
    "make_recording",
    "simulate",
    "truth_of",
]
