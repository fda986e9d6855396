"""Motions: trajectories, grasps, pours and the engine that runs them tick by tick."""
