"""Study of the diagnosis of joints, arms and orthoses on independent simulated rigs."""
