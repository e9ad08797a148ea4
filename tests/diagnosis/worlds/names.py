"""Names of worlds and effects, and the noise that amplitudes are counted in."""

WORLDS = (
    "exponential_pressure_play_lag",
    "polynomial_shift_bouc_wen_overdamped",
    "sine_maxwell_slip_rate_limit",
    "bumpy_map_preisach_dead_time",
    "fibre_bundle_dahl_orifice",
    "braid_gas_spring_lugre_orifice",
    "hunt_tangent_wide_play_underdamped",
    "sarosi_bouc_wen_length_delayed",
    "logistic_skewed_play_all_at_once",
    "rational_end_slip_slow_tail",
    "braid_lock_power_law_iwan_integrating",
    "rubber_energy_root_coulomb_pulsed",
    "end_caps_slack_tanh_play_long_tube",
    "drawn_curve_dead_zone_play_bulging_offset",
    "hyperbolic_tendon_rate_weak_cascade",
    "kinked_table_slip_lag_coarse_fine",
    "ogden_wall_duhem_back_calculation",
    "segment_chain_elastoplastic_throttled_line",
    "barrel_ridge_play_nozzle_flapper",
    "stretched_spring_relaxing_slip_sampled",
    "three_element_back_stress_gap_gain",
)
EFFECTS = (
    "creep",
    "leak",
    "valve_dead_band",
    "dead_time",
    "slew_limit",
    "sensor_bias",
    "sensor_drift",
    "sensor_delay",
    "viscous_loss",
    "temperature",
    "first_cycle_softening",
    "load_dependent_hysteresis",
    "load_dependent_compliance",
    "hysteresis_shape",
    "hysteresis_drive",
    "supply_droop",
    "stick_slip",
    "threshold_pressure",
    "exhaust_asymmetry",
    "pressure_dependent_friction",
    "sensor_nonlinearity",
    "resonance",
    "slip_step",
    "wire_slack",
    "payload_error",
)
OUTSIDE = (
    "building_vibration",
    "supply_crosstalk",
    "position_dropouts",
    "gain_random_walk",
    "end_stop",
    "regulator_dither",
    "pendulum_load",
    "cable_catch",
    "command_steps",
)
ALL = EFFECTS + OUTSIDE

POSITION_NOISE = 0.045  # [mm] RMS
PRESSURE_NOISE = 0.0126  # [bar] RMS
GRAVITY = 9.81  # [m/s2]
STEP = 0.001  # [s] of the integrator

CREEP = ALL.index("creep")
LEAK = ALL.index("leak")
DEAD_BAND = ALL.index("valve_dead_band")
DEAD_TIME = ALL.index("dead_time")
SLEW = ALL.index("slew_limit")
VISCOUS = ALL.index("viscous_loss")
TEMPERATURE = ALL.index("temperature")
SOFTENING = ALL.index("first_cycle_softening")
LOAD_WIDTH = ALL.index("load_dependent_hysteresis")
LOAD_SHIFT = ALL.index("load_dependent_compliance")
SHAPE = ALL.index("hysteresis_shape")
DRIVE = ALL.index("hysteresis_drive")
DROOP = ALL.index("supply_droop")
STICK = ALL.index("stick_slip")
THRESHOLD = ALL.index("threshold_pressure")
EXHAUST = ALL.index("exhaust_asymmetry")
PRESSURE_FRICTION = ALL.index("pressure_dependent_friction")
SLACK = ALL.index("wire_slack")
PAYLOAD = ALL.index("payload_error")
VIBRATION = ALL.index("building_vibration")
CROSSTALK = ALL.index("supply_crosstalk")
WALK = ALL.index("gain_random_walk")
END_STOP = ALL.index("end_stop")
DITHER = ALL.index("regulator_dither")
PENDULUM = ALL.index("pendulum_load")
CATCH = ALL.index("cable_catch")
COMMAND_STEPS = ALL.index("command_steps")
