"""Study of the diagnosis over simulated worlds that it was not developed on."""
