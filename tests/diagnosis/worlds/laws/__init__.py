"""Static force laws of the muscles, and draws of their constants."""

from .draws import draw_law
from .fitted import MAP_SHAPE
from .force import LAWS, balance, force

__all__ = ["LAWS", "MAP_SHAPE", "balance", "draw_law", "force"]
