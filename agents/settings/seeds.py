"""Which environment seeds are for training, which for tuning; those of benchmarks are neither.

Benchmarks use seeds below ``TUNING``, and for audits numbers that nobody can choose. What is
trained here starts at ``TRAINING``; what is looked at while settings are chosen (networks, rates,
how far a policy looks back or ahead) are the seeds from ``TUNING`` on, and no others. So no scored
episode is ever trained on, and none decides a setting.
"""

from __future__ import annotations

TUNING = 900_000
MOST_TUNING = 1_000
TRAINING = 1_000_000


def first_training(seed: int) -> int:
    """Return the seed of the first row of training seed ``seed``; row ``i`` adds ``i``."""
    return TRAINING * (seed + 1)


def tuning(count: int) -> list[int]:
    """Return the seeds of ``count`` tuning episodes.

    Raises
    ------
    ValueError
        If there are not so many.
    """
    if not 1 <= count <= MOST_TUNING:
        raise ValueError(
            f"evaluation.episodes = {count} must be from 1 to {MOST_TUNING}: tuning has so many "
            "seeds; choose fewer"
        )
    return list(range(TUNING, TUNING + count))
