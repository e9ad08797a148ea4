"""Sprung load: only part of the load on the muscle is accelerated.

A constant-force spring, a long elastic or a lever has little mass of its own. Its effect is visible
in fast motion, not in settled readings.
"""

from pam_envs.diagnosis.cause import Cause, Form, Term

CAUSE = Cause(
    name="sprung_load",
    title="a load that acts through a spring",
    forms=(Form("share", (Term("mass.carried", (0.8, 0.4), scale=0.1),)),),
    signature="oscillations faster than the load's mass allows, increasingly so for heavy loads",
    neighbours=("resonance", "payload_error"),
    experiment="Sharp steps under two loads: the frequency of the oscillation shows the mass.",
    source="Construction of this rig.",
    needs=("contraction", "loads"),
    sensor="an accelerometer on the load",
)
