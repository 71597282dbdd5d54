"""Classical rigid rotation: Euler's equations, their exact free motion, integrators, effects and stability."""
