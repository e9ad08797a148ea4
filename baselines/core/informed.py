"""Model-based controllers that are designed from the drawn plant of each episode.

On a track with drawn plants they show how much of an error is due to the model: the same design
from the nominal plant has another entry. They are built as their base is; the caller provides the
true plant, with the parameters drawn in the episode.
"""

from collections.abc import Mapping
from dataclasses import replace

from baselines.core.entry import Entry

SUFFIX = "_informed"
BASES = (
    "inverse",
    "inverse_pid",
    "predictive_inverse",
    "predictive_inverse_dob",
    "knee_inverse_ahead",
    "knee_inverse_ahead_ltr",
    "knee_anticipating",
    "elbow_allocation_early",
    "joint_inverse_ahead",
    "joint_inverse_dob",
    "joint_mfc_mu_ahead",
    "joint_predictive",
)
"""Controllers whose designs use most of the model, of every family of plants."""


def entries(plain: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return the entries with the true model; ``plain`` holds those with the nominal model."""
    return {
        f"{name}{SUFFIX}": replace(
            plain[name],
            summary=f"{name}, designed from the drawn plant of each episode",
            knowledge="true model",
            knobs={},
        )
        for name in BASES
    }
