"""The second paper: Saika sees a falling or a thrown ball, predicts its path and puts a basket there.

Frames. `base` (the shoulder frame): origin midway between the shoulders, x to the robot's right, y forward, z up; the left
arm, which holds the basket, is at negative x. A `camera` is an optical frame: x right, y down, z forward. `hand` has its
origin in the middle of the basket's rim, z out of the basket along the rim's normal, y away from the elbow. The
paper's own x, y, z (Figures 9, 11) are base's x, z, y.
"""
