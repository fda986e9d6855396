"""Tables and figures of the paper, and ours, as functions that return numbers."""
