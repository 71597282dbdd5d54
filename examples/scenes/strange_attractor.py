# %% [markdown]
# # A rigid body that never repeats itself
# R. B. Leipnik and T. A. Newton (Phys. Lett. A 86, 63 (1981)) found two strange attractors in Euler's equations with
# linear feedback. Scaled to x = (√75 ω1, √50 ω2, √150 ω3) the body with moments (1, 3, 2) and torque G ω obeys
#
#     x' = -0.4 x + y + 10 y z,   y' = -x - 0.4 y + 5 x z,   z' = 0.175 z - 5 x y.
#
# The largest exponent is 0.14 ± 0.01 on the upper attractor and 0.13 ± 0.01 on the lower one, natural logarithm per
# time; the sum of all three is the divergence of the flow, -0.625; the Kaplan-Yorke dimension is 2.18.

# %%
import sys

import numpy as np

from rotor.api import LinearDrag, body_flow, lyapunov_exponents, orbit

moments = np.array([1.0, 3.0, 2.0])
scale = np.sqrt([1 / 75, 1 / 50, 1 / 150])  # x_i = scale_i ω_i
linear = np.array([[-0.4, 1.0, 0.0], [-1.0, -0.4, 0.0], [0.0, 0.0, 0.175]])
feedback = moments[:, None] * linear * scale / scale[:, None]
effects = [LinearDrag(-feedback)]


def flow_from(x, y, z):
    """The body's flow from a start in Leipnik and Newton's variables."""
    return body_flow(moments, moments * np.array([x, y, z]) / scale, effects)


upper, lower = flow_from(0.349, 0.0, -0.160), flow_from(0.349, 0.0, -0.180)

# %% [markdown]
# The body's equations are the published ones: compare the rates.

# %%
x, y, z = scale * upper.start / moments
rates = scale * upper.rate(0.0, upper.start[None])[0] / moments
published = [-0.4 * x + y + 10 * y * z, -x - 0.4 * y + 5 * x * z, 0.175 * z - 5 * x * y]
assert np.allclose(rates, published, rtol=1e-13, atol=1e-15)

# %%
for name, flow, expected in (("upper", upper, 0.14), ("lower", lower, 0.1296)):
    exponents = lyapunov_exponents(flow, time=20_000.0, transient=500.0)
    print(f"{name}: {exponents.values.round(4)} ± {exponents.errors.round(4)}, dimension {exponents.kaplan_yorke:.3f}")
    assert abs(exponents.values[0] - expected) < 0.01
    assert abs(np.sum(exponents.values) + 0.625) < 1e-6
    assert abs(exponents.kaplan_yorke - 2.18) < 0.02

# %%
if "--plot" in sys.argv:
    import matplotlib.pyplot as plt

    for flow in (upper, lower):
        path = orbit(flow, np.linspace(100.0, 600.0, 20_001)) / moments * scale
        plt.plot(path[:, 0], path[:, 2], lw=0.3)
    plt.xlabel("x")
    plt.ylabel("z")
    plt.show()
