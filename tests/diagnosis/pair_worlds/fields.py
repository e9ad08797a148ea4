"""Names and units of the numbers that describe a muscle, a regulator and a joint."""

ELEMENTS = 4
"""Number of elements of the Maxwell-slip model."""

MUSCLE = (
    "size",  # force at 2 bar and full length [N]
    "most",  # contraction without force [1]
    "curve",  # of the force over the contraction
    "passive",  # force of the empty muscle at full length [N]
    "friction",  # half width of the loop without pressure [N]
    "growth",  # of the half width by 1 bar [N]
    "onset",  # contraction within which friction builds up [1]
    "viscous",  # [N s] per unit of contraction
    "creep",  # share of the pressure that follows
    "creep_s",  # its time constant [s]
    "loss",  # force of the viscous loss at 0.02 per second [N]
    "threshold",  # pressure that the bladder takes to widen [bar]
    "skew",  # third coefficient of the polynomial in the stretch
    "stiffening",  # of the muscle by 1 bar beyond its proportion [1/bar]
    "bladder",  # bound of its resistance over the size
    "power",  # of the pressure in the half width's growth
    *(f"break_{k}" for k in range(ELEMENTS)),  # contraction to slip, over the onset
    *(f"part_{k}" for k in range(ELEMENTS)),  # of the half width
)
"""Those after the loss belong to the polynomial law and the Maxwell slip."""

VALVE = (
    "rate",  # eigenfrequency [rad/s], or reciprocal lag [1/s]
    "damping",
    "limit",  # [bar/s]; of an orifice, at full length with choked flow
    "gain",
    "offset",  # [bar]
    "dead_s",
    "band",  # dead band of the spool [bar]
    "reset_s",  # integral time of the controller [s]
    "spool_s",  # lag of the spool [s]
    "supply",  # absolute [bar]
    "vent",  # conductance of the exhaust over that of the supply
    "widening",  # of the volume by the contraction, at full length
    "choke",  # critical ratio of pressures
)
"""The last six belong to the orifice."""

JOINT = (
    "inertia",
    "damping",
    "weight",  # mass times distance times gravity [N m]
    "spring",  # [N m/rad]
    "rest",  # angle without its torque [rad]
    "stiction",  # breakaway torque [N m]
    "kinetic",  # over the breakaway torque
    "stribeck",  # [rad/s]
    "bristle",  # deflection of the bristles at breakaway [rad]
)
