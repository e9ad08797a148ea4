"""A load behind a spring: only part of what pulls on the muscle is accelerated.

A constant-force spring, a long elastic or a lever pulls without much mass of its own. Settled
readings do not tell, fast motion does.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="sprung_load",
    title="a load that pulls through a spring",
    forms=(Form("share", (Term("mass.carried", (0.8, 0.4), scale=0.1),)),),
    signature="bounces faster than the load's mass allows, the more the heavier it is",
    neighbours=("resonance", "payload_error"),
    experiment="Sharp steps under two loads: the frequency of the bounce tells the moving mass.",
    source="How this rig is built.",
    needs=("contraction", "loads"),
    sensor="an accelerometer on the load",
)
