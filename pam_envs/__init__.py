"""Gymnasium environments for the control of pneumatic artificial muscles.

``import pam_envs`` registers the environments; ``gymnasium.make("PAM/MusclePositioning-v0")``
makes one. :func:`register_family` registers a family from another package.
"""

from pam_envs import checkout
from pam_envs.envs.registration import register_all, register_family

__all__ = ["register_all", "register_family"]
__version__ = "0.1.0"
checkout.install()
register_all()
