"""Independent rigs of the plants other than a single muscle, in other mathematics than the plants.

Geometry, masses and sizes of the muscles are those that a laboratory would measure; the laws of
force, friction and regulators share no equation and no code with the package.
"""

from .rigs import FAMILIES, HIDDEN, WORLDS, record

__all__ = ["FAMILIES", "HIDDEN", "WORLDS", "record"]
