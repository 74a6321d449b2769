"""Faults, fuzz, load and soak: what the node and the solver are put through. Not installed; see scripts/torture."""
