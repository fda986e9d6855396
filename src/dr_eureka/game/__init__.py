"""The puzzle: states, pours, plans and the two-handed actions that carry them out."""
