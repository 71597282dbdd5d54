# %% [markdown]
# # The vortex of an ellipsoidal cavity moves as a rigid body
# An ideal fluid of uniform vorticity ω in a fixed ellipsoidal cavity of semi-axes a: Helmholtz's equation dω/dt = (ω·∇)u with the
# linear flow u that does not cross the wall (H. Poincaré, Bull. astron. 27, 321 (1910)).
# Coordinates divided by the semi-axes turn as a rigid body at Ω, ω_i = Ω_i (a_j² + a_k²)/(a_j a_k), and ω_i/a_i turns along. So
# L_i = ω_i/a_i obeys Euler's equations, backwards in time, with moments in proportion to those of the solid ellipsoid, a_j² + a_k².

# %%
import numpy as np
from scipy.integrate import solve_ivp

from rotor.api import free_motion

semiaxes = np.array([3.0, 2.0, 1.2])
squares = semiaxes**2
moments = (squares.sum() - squares) / semiaxes.prod()  # Ω = L/moments
vorticity = np.array([0.3, 1.0, 0.2])


def gradient(omega):
    """∂u_i/∂x_j: a_i (Ω x)_ij / a_j."""
    x, y, z = omega / semiaxes / moments
    turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return semiaxes[:, None] * turn / semiaxes


flow = gradient(vorticity)
assert np.allclose([flow[2, 1] - flow[1, 2], flow[0, 2] - flow[2, 0], flow[1, 0] - flow[0, 1]], vorticity, atol=1e-15)

# %% [markdown]
# The exact top beside Helmholtz's equation integrated over a period: the vortex turns over about the middle axis as a book does.

# %%
top = free_motion(moments, vorticity / semiaxes)
times = np.linspace(0.0, float(top.period), 60)
as_top = top.at(-times)[0] * semiaxes
helmholtz = solve_ivp(
    lambda time, omega: gradient(omega) @ omega, (0.0, times[-1]), vorticity, t_eval=times, rtol=1e-11, atol=1e-13
).y.T
print(
    f"the vortex repeats after {times[-1]:.4f}; its largest departure from the top is {np.abs(as_top - helmholtz).max():.0e}"
)
assert np.allclose(as_top, helmholtz, rtol=0.0, atol=1e-8)  # of the integration
