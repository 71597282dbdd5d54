# %% [markdown]
# # A body in an ideal fluid that moves as Euler's top
# Kirchhoff's equations of a body in an ideal fluid at rest at infinity, M' = M x ω + p x u and p' = p x ω, have energy
# ½ M·ω + ½ p·u with M = (I + K) ω, p = (m + m_f A) u: the fluid adds moments K and masses. When the total impulse p is
# zero they are Euler's equations with the moments I + K (H. Lamb, Hydrodynamics, sections 124 and 115). Of an ellipsoid
#
#     K1 = (m_f/5) (b² - c²)² (γ - β) / (2 (b² - c²) + (b² + c²)(β - γ)),   α = abc ∫ dλ / ((a² + λ) Δ), ...
#
# with α + β + γ = 2, nothing for a sphere, and 16/45 ρ r⁵ for a thin disc turning about a diameter.

# %%
import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import elliprd

from rotor.classical.euler import gyroscopic_term
from rotor.classical.free.free_motion import free_motion


def shape_integrals(semiaxes):
    """Lamb's α, β, γ by Carlson's integral R_D."""
    a2, b2, c2 = np.square(semiaxes)
    return 2.0 / 3.0 * np.prod(semiaxes) * np.array([elliprd(b2, c2, a2), elliprd(c2, a2, b2), elliprd(a2, b2, c2)])


def added_moments(semiaxes, density):
    """K (3,) of an ellipsoid."""
    alpha, squares = shape_integrals(semiaxes), np.square(semiaxes)
    fluid = density * 4.0 / 3.0 * np.pi * np.prod(semiaxes)
    added = []
    for k in range(3):
        (b2, c2), (beta, gamma) = (np.roll(v, -k)[1:] for v in (squares, alpha))
        added.append(fluid / 5 * (b2 - c2) ** 2 * (gamma - beta) / (2 * (b2 - c2) + (b2 + c2) * (beta - gamma)))
    return np.array(added)


semiaxes = np.array([3.0, 2.0, 1.2])
assert np.isclose(shape_integrals(semiaxes).sum(), 2.0, rtol=1e-14)
assert np.isclose(added_moments([1e-5, 1.0 + 1e-9, 1.0], 1.0)[2], 16.0 / 45.0, rtol=1e-4)  # not quite thin
assert np.isclose(added_moments([1e-5, 1.0, 1.0 + 1e-9], 1.0)[1], 16.0 / 45.0, rtol=1e-4)

# %% [markdown]
# A neutrally buoyant ellipsoid of density 1. Kirchhoff's equations from p = 0, stepped, beside the exact top of moments
# I + K: one motion. The period is not that in the void.

# %%
body = 4.0 / 3.0 * np.pi * np.prod(semiaxes)
squares = np.square(semiaxes)
inertia = body / 5.0 * (squares.sum() - squares)
moments = inertia + added_moments(semiaxes, 1.0)
alpha = shape_integrals(semiaxes)
masses = body * (1.0 + alpha / (2.0 - alpha))  # Lamb, section 114


def kirchhoff(_, y):
    """d(M, p)/dt."""
    momentum, impulse = y[:3], y[3:]
    omega, velocity = momentum / moments, impulse / masses
    turning = np.add(gyroscopic_term(*momentum, *omega), gyroscopic_term(*impulse, *velocity))
    return np.concatenate([turning, gyroscopic_term(*impulse, *omega)])


start = moments * [0.3, 1.0, 0.2]
top = free_motion(moments, start)
times = np.linspace(0.0, 3.0 * float(top.period), 50)
wet = solve_ivp(kirchhoff, times[[0, -1]], [*start, 0, 0, 0], "DOP853", t_eval=times, rtol=1e-12, atol=1e-12)
exact, _ = top.at(times)
dry = float(free_motion(inertia, inertia * [0.3, 1.0, 0.2]).period)
print(f"period {float(top.period):.4f} in the fluid, {dry:.4f} in the void, from the same angular velocity")
assert np.max(np.abs(wet.y[:3].T - exact)) < 1e-8 * np.linalg.norm(start)
assert abs(float(top.period) / dry - 1.0) > 0.1

# %% [markdown]
# With an impulse the energy, p² and M·p are still kept, and the body is no longer a free top.

# %%
impulse = [40.0, 25.0, 10.0]
pushed = solve_ivp(kirchhoff, times[[0, -1]], [*start, *impulse], "DOP853", t_eval=times, rtol=1e-12, atol=1e-12)
m, p = pushed.y[:3], pushed.y[3:]
for kept in ((m**2 / moments[:, None] + p**2 / masses[:, None]).sum(0), (p**2).sum(0), (m * p).sum(0)):
    assert np.ptp(kept) < 1e-9 * np.max(np.abs(kept))
assert np.max(np.abs(m.T - exact)) > 0.1 * np.linalg.norm(start)
