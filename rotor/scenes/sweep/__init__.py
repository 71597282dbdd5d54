"""A scene run for several molecules or values: its points, what is done of them, and their results."""

from rotor.scenes.sweep.points import Point, is_sweep, points
from rotor.scenes.sweep.record import SweepResult
from rotor.scenes.sweep.run import run_sweep

__all__ = ["Point", "SweepResult", "is_sweep", "points", "run_sweep"]
