"""vec_envs."""
