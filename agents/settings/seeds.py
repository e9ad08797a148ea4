"""Disjoint environment seeds for training and for tuning, apart from those of benchmarks.

Training uses seeds from ``TRAINING`` on; evaluations that choose settings and policies use the
seeds from ``TUNING`` on. Scenarios use seeds below ``TUNING``, and each audit round draws its own.
Scored episodes are therefore used neither in training nor in the choice of settings.
"""

TUNING = 900_000
MOST_TUNING = 1_000
TRAINING = 1_000_000


def first_training(seed: int) -> int:
    """Return the seed of the first row of training seed ``seed``; row ``i`` adds ``i``."""
    return TRAINING * (seed + 1)


def tuning(count: int) -> list[int]:
    """Return the seeds of ``count`` tuning episodes; a ValueError if there are fewer."""
    if not 1 <= count <= MOST_TUNING:
        raise ValueError(
            f"evaluation.episodes = {count} must be from 1 to {MOST_TUNING}, the number of tuning "
            "seeds; choose fewer"
        )
    return list(range(TUNING, TUNING + count))
