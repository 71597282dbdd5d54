"""Numbers that every motion of the package gives, for `test_one_core.py`: run as a program it prints them as JSON.

    python tests/helpers/core_probes.py [folder of scenes]

Nothing here asserts anything: the numbers of a whole package are compared with those of one whose core was changed.
"""

import ast
import json
import math
import sys
from pathlib import Path

import numpy as np

MOMENTS, MOMENTUM = [0.6, 0.8, 1.0], [1.8, 0.4, -0.9]
# scenes that take seconds are shortened: here only the numbers count, not the published figures
SHORTER = {
    "optical_centrifuge": [
        ("np.linspace(0.0, 100.0, 201)", "np.linspace(0.0, 2.0, 21)"),
        ("count, end, kt = 1000, 20.0", "count, end, kt = 20, 1.0"),
    ],
    "strange_attractor": [("time=20_000.0, transient=500.0", "time=60.0, transient=1.0, segments=2")],
    "rattleback": [("np.arange(0.0, seconds, 0.02)", "np.arange(0.0, 0.1, 0.02)")],
}


def numbers(value):
    """All finite floats of a value, nested as it may be; what is not a number gives nothing."""
    if isinstance(value, (bool, str, bytes)) or callable(value):
        return []
    if isinstance(value, (int, float, np.number, np.ndarray)):
        array = np.asarray(value)
        parts = [array.real, array.imag] if np.iscomplexobj(array) else [array]
        return [float(x) for part in parts if part.dtype.kind in "iuf" for x in part.ravel() if math.isfinite(x)]
    if isinstance(value, (list, tuple)):
        return [x for item in value for x in numbers(item)]
    fields = getattr(value, "__dataclass_fields__", {})
    return [x for name in fields for x in numbers(getattr(value, name))]


def motion_numbers(motion):
    return numbers([motion.momentum, motion.attitude, motion.energy])


def tumble():
    from rotor.classical.free.free_motion import free_motion
    from rotor.classical.motion import sampled

    return numbers(sampled(free_motion(MOMENTS, MOMENTUM), np.linspace(0.0, 5.0, 7)))


def stepped(method, effects=(), times=(0.0, 0.7)):
    from rotor.classical.integrators.method import integrate

    return motion_numbers(integrate(method, MOMENTS, MOMENTUM, times, effects=effects))


def driven(method):
    from rotor.classical.effects.dipole_in_field import PermanentDipole
    from rotor.classical.effects.gyrostat import SpinningRotor

    return stepped(method, [PermanentDipole([0.3, 0.1, 0.2], [0, 0, 1.0]), SpinningRotor([0.1, 0.0, 0.2])])


def batch():
    from rotor.classical.integrators.batch import propagate

    return numbers(propagate(MOMENTS, np.array([MOMENTUM]), [1.0, 0, 0, 0], 0.05, 20))


def compiled(method):
    """The same in the compiled form, which otherwise only long motions take."""
    from rotor.classical.integrators import lie_runge_kutta, splitting

    usual = splitting.WORTH_LOADING, lie_runge_kutta.PLAIN_STEPS
    splitting.WORTH_LOADING = lie_runge_kutta.PLAIN_STEPS = 0
    try:
        return driven(method)
    finally:
        splitting.WORTH_LOADING, lie_runge_kutta.PLAIN_STEPS = usual


def batch_in_field():
    from rotor.classical.effects.dipole_in_field import PermanentDipole
    from rotor.classical.integrators.driven_batch import propagate_driven

    dipole = PermanentDipole([0.3, 0.1, 0.2], [0, 0, 1.0])
    return numbers(propagate_driven(MOMENTS, np.array([MOMENTUM]), [1.0, 0, 0, 0], 0.05, 20, [dipole]))


def gas_exact():
    from rotor.classical.gas.ensembles import free_gas_correlations

    gas = free_gas_correlations(
        MOMENTS, 1.0, [0.0, 0.4, 1.1], vector=[1, 0, 0], molecules=20, rng=np.random.default_rng(1)
    )
    return numbers(gas.c1)


def gas_stepped():
    from rotor.classical.gas.ensembles import stepped_gas_correlations

    gas = stepped_gas_correlations(
        MOMENTS, 1.0, 0.1, 4, steps=4, vector=[1, 0, 0], molecules=20, rng=np.random.default_rng(1)
    )
    return numbers(gas.c1)


def gas_beginning():
    from rotor.classical.gas.correlations import short_time

    return numbers(short_time(MOMENTS, 1.0, [0.0, 0.0, 1.0]))


def gas_equipartition():
    from rotor.classical.gas.ensembles import thermal_ensemble

    ensemble = thermal_ensemble(MOMENTS, 1.0, 5, rng=np.random.default_rng(2))
    return [x for energies in ensemble.kinetic.energies.values() for x in numbers(energies)]


def fluid():
    from ase import units
    from ase.build import molecule
    from ase.calculators.lj import LennardJones

    from rotor.fluids.motion.dynamics import RigidDynamics

    pair = molecule("H2O") + molecule("H2O")
    pair.positions[3:] += [3.4, 0.3, 0.0]
    pair.set_momenta(0.2 * np.random.default_rng(3).normal(size=(6, 3)))
    pair.calc = LennardJones(sigma=1.6, epsilon=0.01, rc=20.0)
    dynamics = RigidDynamics(pair, 1.0 * units.fs, molecules=[0, 0, 0, 1, 1, 1], removed=0)
    dynamics.run(3)
    state = dynamics.state
    return numbers([state.spin, pair.positions, list(vars(dynamics.kinetic()).values())])


def exponents(effects, attitude):
    from rotor.classical.lyapunov import body_flow, lyapunov_exponents

    flow = body_flow(MOMENTS, MOMENTUM, effects, attitude)
    return numbers(lyapunov_exponents(flow, time=6.0, segments=2, tolerance=1e-8))


def lyapunov():
    from rotor.classical.effects.drag import LinearDrag

    return exponents([LinearDrag([0.1, 0.2, 0.1])], [1.0, 0, 0, 0])


def lyapunov_in_field():
    from rotor.classical.effects.dipole_in_field import PermanentDipole

    return exponents([PermanentDipole([0.3, 0.1, 0.2], [0, 0, 1.0])], [1.0, 0, 0, 0])


def scene(path):
    """Numbers of a scene's global variables, its assertions left out."""
    text = path.read_text(encoding="utf-8")
    for before, after in SHORTER.get(path.stem, []):
        if before not in text:
            raise ValueError(f"{path.name}: expected the text {before!r}; change SHORTER with the scene")
        text = text.replace(before, after)
    tree = ast.parse(text)
    tree.body = [node for node in tree.body if not isinstance(node, ast.Assert)]
    for node in ast.walk(tree):
        if hasattr(node, "body") and isinstance(node.body, list) and not isinstance(node, ast.Module):
            node.body = [child for child in node.body if not isinstance(child, ast.Assert)] or [ast.Pass()]
    names = {"__name__": "scene"}
    exec(compile(ast.fix_missing_locations(tree), str(path), "exec"), names)
    return [x for name in sorted(names) if not name.startswith("_") for x in numbers(names[name])]


def methods():
    from rotor.classical.integrators.exact_drift import ExactDrift
    from rotor.classical.integrators.lie_runge_kutta import LieRungeKutta
    from rotor.classical.integrators.moser_veselov import MoserVeselov
    from rotor.classical.integrators.splitting import RotationSplitting, SymmetricTopSplitting

    return {
        "SymmetricTopSplitting": lambda: driven(SymmetricTopSplitting(0.05, 4)),
        "SymmetricTopSplitting, compiled": lambda: compiled(SymmetricTopSplitting(0.05, 4)),
        "ExactDrift": lambda: driven(ExactDrift(0.35)),
        "LieRungeKutta": lambda: driven(LieRungeKutta(1e-8)),
        "LieRungeKutta, compiled": lambda: compiled(LieRungeKutta(1e-8)),
        "RotationSplitting": lambda: driven(RotationSplitting(0.05, 4)),
        "MoserVeselov": lambda: stepped(MoserVeselov(0.05)),
        "MoserVeselov, order 4": lambda: stepped(MoserVeselov(0.05, 4)),
    }


def probes(scenes):
    """A function for each motion, by the name that docs/validation/classical_core.md gives it."""
    value = {
        "free motion, `rotor tumble`": tumble,
        "many free bodies, `propagate`": batch,
        "many bodies in a field, `propagate_driven`": batch_in_field,
        "gas: correlations, exact": gas_exact,
        "gas: correlations, stepped": gas_stepped,
        "gas: short times": gas_beginning,
        "gas: equipartition": gas_equipartition,
        "fluid, `RigidDynamics`": fluid,
        "Lyapunov exponents, of L": lyapunov,
        "Lyapunov exponents, of L and q": lyapunov_in_field,
    }
    scene_probes = {f"scene {path.stem}": (lambda path=path: scene(path)) for path in sorted(scenes.glob("*.py"))}
    return value | {f"`{name}`": probe for name, probe in methods().items()} | scene_probes


def main():
    scenes = Path(sys.argv[1])
    sys.argv, out = sys.argv[:1], sys.stdout
    sys.stdout = sys.stderr  # what scenes print
    answers = {}
    for name, probe in probes(scenes).items():
        try:
            answers[name] = probe()
        except (ValueError, ArithmeticError, LookupError, np.linalg.LinAlgError) as error:
            answers[name] = repr(error)
    json.dump(answers, out)


if __name__ == "__main__":
    main()
