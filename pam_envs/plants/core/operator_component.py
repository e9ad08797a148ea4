"""The component of a plant that holds its hysteresis operator."""

from __future__ import annotations

from dataclasses import dataclass

from pam_envs.hysteresis.protocol import HysteresisModel, choice_of, operator_of


@dataclass(frozen=True)
class OperatorComponent:
    """Hysteresis of a plant.

    Attributes
    ----------
    operator : HysteresisModel or None
        The operator; None for no hysteresis.
    """

    operator: HysteresisModel | None = None

    @property
    def model(self) -> HysteresisModel:
        """The operator, the identity in place of None."""
        return operator_of(self.operator)

    @property
    def kind(self) -> str:
        """Registered kind of the operator, which selects the kernels."""
        return self.model.kind

    @property
    def choice(self) -> str:
        """Value of ``hysteresis=`` that the operator belongs to."""
        return choice_of(self.operator)
