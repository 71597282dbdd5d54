# %% [markdown]
# # A body in an ideal fluid that moves as Euler's top
# Kirchhoff's equations of a body in an ideal fluid at rest at infinity, M' = M x ω + p x u and p' = p x ω, have energy
# ½ M·ω + ½ p·u with M = (I + K) ω, p = (m + m_f A) u: the fluid adds moments K and masses. The impulse p is constant in
# space, so that they are Euler's equations with the moments I + K and a torque p x u; when p is zero, a free top
# (H. Lamb, Hydrodynamics, sections 124 and 115). α + β + γ = 2 holds for Lamb's integrals of the shape; a sphere has no
# added moments, a thin disc of radius r that turns about a diameter 16/45 ρ r⁵.

# %%
import numpy as np

from rotor.api import (
    FluidImpulse,
    LieRungeKutta,
    SymmetricTopSplitting,
    added_masses,
    added_moments,
    conjugate,
    distance,
    free_motion,
    integrate,
    rotate,
    shape_integrals,
)

semiaxes = np.array([3.0, 2.0, 1.2])
assert np.isclose(shape_integrals(semiaxes).sum(), 2.0, rtol=1e-14)
assert np.isclose(added_moments([1e-5, 1.0 + 1e-9, 1.0], 1.0)[2], 16.0 / 45.0, rtol=1e-4)  # not quite thin
assert np.isclose(added_moments([1e-5, 1.0, 1.0 + 1e-9], 1.0)[1], 16.0 / 45.0, rtol=1e-4)

# %% [markdown]
# A neutrally buoyant ellipsoid of density 1 without an impulse: the exact top of moments I + K beside a stepped one. The
# period is not that in the void.

# %%
body = 4.0 / 3.0 * np.pi * np.prod(semiaxes)
squares = np.square(semiaxes)
inertia = body / 5.0 * (squares.sum() - squares)
moments = inertia + added_moments(semiaxes, 1.0)
masses = body + added_masses(semiaxes, 1.0)

start = moments * [0.3, 1.0, 0.2]
top = free_motion(moments, start)
times = np.linspace(0.0, 3.0 * float(top.period), 50)
exact, _ = top.at(times)
still = FluidImpulse([0.0, 0.0, 0.0], masses)
wet = integrate(LieRungeKutta(1e-11), moments, start, times, effects=[still])
dry = float(free_motion(inertia, inertia * [0.3, 1.0, 0.2]).period)
print(f"period {float(top.period):.4f} in the fluid, {dry:.4f} in the void, from the same angular velocity")
assert np.max(np.abs(wet.momentum - exact)) < 1e-8 * np.linalg.norm(start)
assert abs(float(top.period) / dry - 1.0) > 0.1

# %% [markdown]
# With an impulse the body is no longer a free top. The energy and M·p are conserved still (p² in space is constant by
# construction), by a symplectic splitting too, since the torque depends on the attitude alone.

# %%
impulse = np.array([40.0, 25.0, 10.0])
push = FluidImpulse(impulse, masses)
pushed = integrate(LieRungeKutta(1e-12), moments, start, times, effects=[push])
split = integrate(SymmetricTopSplitting(0.02, 4), moments, start, times, effects=[push])
p = rotate(conjugate(pushed.attitude), impulse)
u, m, omega = p / masses, pushed.momentum, pushed.omega
for conserved in (pushed.energy, 0.5 * np.sum(m * omega + p * u, axis=-1), np.sum(m * p, axis=-1)):
    assert np.ptp(conserved) < 1e-9 * np.max(np.abs(conserved))
assert np.max(np.abs(m - exact)) > 0.1 * np.linalg.norm(start)
assert np.max(distance(split.attitude, pushed.attitude)) < 1e-5  # order 4: 16 times less with half the step

# %% [markdown]
# Kirchhoff's first equation itself: dM/dt, by differences along the motion, is M x ω + p x u.

# %%
h = 1e-3
near = integrate(LieRungeKutta(1e-12), moments, start, [0.0, 1.0 - h, 1.0, 1.0 + h], effects=[push])
now = rotate(conjugate(near.attitude[2]), impulse)
rate = (near.momentum[3] - near.momentum[1]) / (2.0 * h)
kirchhoff = np.cross(near.momentum[2], near.omega[2]) + np.cross(now, now / masses)
assert np.allclose(rate, kirchhoff, rtol=0.0, atol=1e-5 * np.max(np.abs(kirchhoff)))  # h² of a central difference
