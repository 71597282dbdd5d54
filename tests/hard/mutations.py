"""Safeguards taken away one by one, in a copy of the package, each with the tests that must go red.

python tests/hard/mutations.py          # all of them; exit code 1 if one stays green
python tests/hard/mutations.py 7 21     # those of some cases
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Mutation:
    """A safeguard of a case: the text of a file that is replaced, and the test that must then fail."""

    case: int
    file: str
    old: str
    new: str
    test: str


WHOLE_MATRIX = """
    blocks_of_j = [[block for block in blocks if block.j == j] for j in dict.fromkeys(block.j for block in blocks)]
    return [piece for whole in blocks_of_j for piece in _whole(whole[0].j, scalar_energy(operators, whole[0].j), operators, whole)]


def _whole(j, scalar, operators, whole):
    from scipy.linalg import block_diag, eigh

    out, of_k, parts = [], np.zeros((2 * j + 1, 2 * j + 1)), list(block_bands(operators, whole))
    for block, start in zip(whole, np.cumsum([0] + [b.size for b in whole]), strict=False):
        for row, k in enumerate(block.k):
            of_k[start + row, j + k] += np.sqrt(0.5) if k else 1.0
            of_k[start + row, j - k] += block.sign * np.sqrt(0.5) if k else 0.0
    joined = block_diag(*[sum(np.diag(b, -n) + (np.diag(b, n) if n else 0) for n, b in enumerate(p)) for p in parts])
    energies, states = eigh(of_k.T @ joined @ of_k)
    states = of_k @ states
    shares = np.add.reduceat(states**2, np.cumsum([0] + [b.size for b in whole])[:-1], axis=0)
    start = 0
    for place, block in enumerate(whole):
        mine = np.sort(np.argsort(-shares[place])[: block.size])
        out.append((block, energies[mine] + scalar, states[start : start + block.size, mine]))
        start += block.size
    return out
"""
BY_OVERLAP = """
    for n in range(1, len(fields)):
        follow = np.abs(vectors[n - 1].conj().T @ vectors[n]).argmax(axis=1)
        energies[n], vectors[n] = energies[n][follow], vectors[n][:, follow]
    states = type(states)(states.block, states.rows, energies, states.places, vectors, states.error)
"""

MUTATIONS = (
    Mutation(
        1, "rotor/quantum/wang/rotation.py",
        "    ka, kc = names_of_blocks(functions, sizes, representation)\n",
        "    ka, kc = names_of_blocks(functions, sizes, representation)\n"
        "    largest = np.concatenate([b.start + np.abs(b.vectors).argmax(axis=0) for b in blocks])\n"
        "    ka, kc = ka[largest], kc[largest]\n",
        "tests/quantum/test_levels.py::test_every_label_stands_once",
    ),
    Mutation(
        2, "rotor/quantum/estimates/convergence.py",
        "    disordered = disordered_blocks(top, levels)\n    if not disordered:",
        "    disordered = disordered_blocks(top, levels)\n    if True:",
        "tests/package/test_reliability.py::test_quartic_water_is_told_of",
    ),
    Mutation(
        3, "rotor/quantum/wang/rotation.py",
        "    return [(block, scalar_energy(operators, block.j), each) for block, each in zip(blocks, bands, strict=True)]\n",
        WHOLE_MATRIX,
        "tests/hard/test_safeguards.py::test_vectors_of_near_degenerate_partners_lie_in_one_block",
    ),
    Mutation(
        4, "rotor/quantum/wang/wang_matrix.py",
        "            energies, states = np.linalg.eigh(whole)\n",
        "            energies, states = np.linalg.eigh(whole)\n"
        "            turned = (np.diff(stacked[:, :: size + 1]) < 0).any(axis=1)\n"
        "            energies[turned] = np.sort(stacked[turned][:, :: size + 1])\n",
        "tests/hard/test_safeguards.py::test_energies_are_eigenvalues_where_the_diagonal_turns_round",
    ),
    Mutation(
        5, "rotor/tops/distortion.py",
        "        if abs(bx - by) < _NEAR_SYMMETRIC * bz:", "        if False:",
        "tests/molecules/test_distortion.py::test_near_symmetric_tops_refuse_the_a_reduction",
    ),
    Mutation(
        5, "rotor/quantum/reductions.py",
        "    place = [old.index(axis) for axis in new]", "    place = [old.index(axis) for axis in (new if new[2] != old[2] else old)]",
        "tests/quantum/estimates/test_conversions.py::test_left_handed_axes_change_signs_alone",
    ),
    Mutation(
        6, "rotor/tops/constants/kind_of_constants.py",
        '    if rigid == "AB" or (rigid == "ABC" and values["B"] == values["C"]):\n        return "prolate"',
        '    if rigid == "AB" or (rigid == "ABC" and abs(values["B"] / values["C"] - 1) < 1e-5):\n        return "prolate"',
        "tests/hard/test_safeguards.py::test_the_doublet_of_a_near_symmetric_top_is_there",
    ),
    Mutation(
        7, "rotor/quantum/wang/rotation.py",
        "    return [(block, scalar_energy(operators, block.j), each) for block, each in zip(blocks, bands, strict=True)]\n",
        "    pieces = list(zip(blocks, bands, strict=True))\n    for block, each in pieces:\n"
        "        each[0] += scalar_energy(operators, block.j)\n    return [(block, 0.0, each) for block, each in pieces]\n",
        "tests/quantum/test_safeguards.py::test_the_scalar_part_stays_out_of_the_matrix",
    ),
    Mutation(
        8, "rotor/geometry/inertia.py",
        "    moments = np.where(moments < 1e-12 * moments[2], 0.0, moments)\n", "",
        "tests/tops/test_top.py::test_linear_in_any_orientation",
    ),
    Mutation(
        9, "rotor/geometry/inertia.py", "LINEAR_BELOW = 1e-6", "LINEAR_BELOW = 1e-14",
        "tests/tops/test_top.py::test_near_linear_says_by_which_number",
    ),
    Mutation(
        10, "rotor/quantum/wang/spherical_top.py",
        "    a_states, e_states = states[:, characters > 0.25], states[:, characters < 0.25]  # 1 and -½",
        "    a_states, e_states = np.split(np.linalg.eigh(matrix)[1], [(characters > 0.25).sum()], axis=1)",
        "tests/tops/spins/test_clusters.py::test_eigenvalues_and_irreps_of_the_full_matrix",
    ),
    Mutation(
        11, "rotor/tops/spins/spin_weights.py",
        "        if self.rule == \"none\":\n            return np.asarray(np.where(k == 0, 1, 2))",
        "        if self.rule in (\"none\", \"KaKc\"):\n            return np.asarray(np.where(k == 0, 1, 2))",
        "tests/tops/spins/test_spin_statistics.py::test_accidental_symmetric_top_keeps_its_weights",
    ),
    Mutation(
        12, "rotor/structures/least_squares.py",
        "        and family.planar\n", "        and not family.planar\n",
        "tests/hard/test_safeguards.py::test_three_dependent_moments_of_a_planar_molecule_are_named",
    ),
    Mutation(
        13, "rotor/tops/isotopes/isotopic_scaling.py",
        "    best = max(ways, key=lambda way: round(sum(squares[i, j] for i, j in enumerate(way)), 9))", "    best = next(ways)",
        "tests/molecules/test_isotopologues.py::test_axes_that_change_places_are_matched_by_overlap",
    ),
    Mutation(
        14, "rotor/geometry/inertia.py",
        "    if not (np.isfinite(m).all() and (m > 0).all() and np.isfinite(r).all()):", "    if False:",
        "tests/tops/test_inertia.py::test_impossible_masses",
    ),
    Mutation(
        15, "rotor/molecules/readers/xyz.py",
        "    plain = word.translate(_MINUS_SIGNS)", "    plain = word",
        "tests/molecules/readers/test_xyz.py::test_every_line_ending_mark_minus_and_exponent_gives_the_same",
    ),
    Mutation(
        15, "rotor/molecules/readers/xyz.py",
        '        return float(plain.replace("D", "e").replace("d", "e"))', '        return float(plain.replace("D", "").replace("d", "e"))',
        "tests/molecules/readers/test_xyz.py::test_every_line_ending_mark_minus_and_exponent_gives_the_same",
    ),
    Mutation(
        16, "rotor/statistics/regression.py",
        "    safe = np.where(blind, 1.0, scale)", "    safe = np.ones_like(scale)",
        "tests/fitting/test_fit.py::test_a_of_a_near_prolate_chain_has_an_honest_error",
    ),
    Mutation(
        17, "rotor/statistics/regression.py",
        "    covariance[np.diag_indices_from(covariance)] = np.where(open_, np.inf, np.diag(covariance))\n", "",
        "tests/statistics/test_least_squares.py::test_what_is_not_determined_is_named",
    ),
    Mutation(
        18, "rotor/quantum/labels/tracking.py",
        "        if not moved.any():", "        if True:",
        "tests/fitting/test_fit_spcat.py::test_labels_follow_their_states_where_energies_cross",
    ),
    Mutation(
        19, "rotor/statistics/least_squares.py",
        "    return CONVERGED if left < BENT * max(1.0, state.rms) else STALLED", "    return CONVERGED",
        "tests/statistics/test_least_squares.py::test_a_search_at_the_edge_of_the_model_has_not_converged",
    ),
    Mutation(
        19, "rotor/statistics/least_squares.py",
        "                return state.ended(EXHAUSTED, linear, taken)", "                return state.ended(CONVERGED, linear, taken)",
        "tests/statistics/test_least_squares.py::test_it_does_not_say_that_it_has_converged_when_it_has_not",
    ),
    Mutation(
        20, "rotor/quantum/levels.py", "self.energy_mhz[self.weight > 0].min()", "self.energy_mhz.min()",
        "tests/requests/test_requests.py::test_levels_count_from_the_lowest_that_exists",
    ),
    Mutation(
        21, "rotor/spectra/transitions/pairs.py",
        "        keep &= (levels.weight[lower] > 0) & (levels.weight[upper] > 0)\n", "",
        "tests/quantum/test_safeguards.py::test_levels_that_do_not_exist_make_no_lines_in_closed_form",
    ),
    Mutation(
        22, "rotor/quantum/fields/field_map.py",
        "    block, fields = states.block, request.fields\n",
        "    block, fields, vectors, energies = states.block, request.fields, states.vectors.copy(), states.energies.copy()\n" + BY_OVERLAP,
        "tests/hard/test_safeguards.py::test_labels_are_ranks_whatever_the_grid",
    ),
    Mutation(
        23, "rotor/quantum/fields/field_map.py",
        "        if error <= request.tolerance_mhz and leaked", "        if True or leaked",
        "tests/quantum/fields/test_field_bounds.py::test_the_lowest_j_max_is_chosen",
    ),
    Mutation(
        23, "rotor/quantum/fields/block_states.py",
        "max() <= PART_OF_TOLERANCE * tolerance_mhz:", "max() <= np.inf:",
        "tests/quantum/fields/test_field_bounds.py::test_enough_free_states_are_taken_at_the_strongest_field",
    ),
    Mutation(
        23, "rotor/quantum/fields/solver.py",
        "if spanned is None or spanned[1][2].max() > tolerance_mhz:", "if spanned is None:",
        "tests/quantum/fields/test_field_bounds.py::test_stated_errors_are_bounds",
    ),
    Mutation(
        23, "rotor/quantum/fields/solver.py",
        "            if error.max(initial=0.0) > PART_OF_TOLERANCE * tolerance_mhz:", "            if False:",
        "tests/quantum/fields/test_field_bounds.py::test_the_basis_grows_until_its_error_is_within_the_tolerance",
    ),
    Mutation(
        23, "rotor/quantum/fields/block_states.py",
        "lowering + mixed.sum(axis=2)", "lowering",
        "tests/quantum/fields/test_field_bounds.py::test_the_bound_in_small_cases",
    ),
    Mutation(
        24, "rotor/alignment/pulse.py", "    2 * math.pi * 1e-30 * 1e4", "    4 * math.pi * 1e-30 * 1e4",
        "tests/hard/test_safeguards.py::test_the_factor_of_an_oscillating_field",
    ),
    Mutation(
        25, "rotor/classical/free/theta.py",
        "        rates=np.stack([c.pace.hi, c.pace.lo, c.start.hi, c.start.lo, half_turns.hi, half_turns.lo], axis=-1),",
        "        rates=np.stack([c.pace.hi, 0 * y, c.start.hi, 0 * y, half_turns.hi, 0 * y], axis=-1),",
        "tests/classical/free/test_free.py::test_double_double_phases_are_what_keeps_a_million_periods",
    ),
    Mutation(
        26, "rotor/geometry/rotations.py", "    angle = np.asarray(2.0 * np.arctan2(sine, q[..., 0]))",
        "    angle = np.asarray(2.0 * np.arccos(np.clip(q[..., 0], -1.0, 1.0)))",
        "tests/geometry/test_rotations.py::test_log_gives_back_the_smallest_rotation_vectors_in_any_direction",
    ),
    Mutation(
        27, "rotor/classical/exponents.py", "        errors=np.hypot(spread, settings.bias),", "        errors=spread,",
        "tests/hard/test_safeguards.py::test_the_growth_of_a_free_body_is_within_its_error_of_zero",
    ),
    Mutation(
        28, "rotor/statistics/degrees_of_freedom.py",
        "    turns = rotating_axes(array, linear_below).sum(axis=-1)",
        "    turns = 3 * rotating_axes(array, linear_below).any(axis=-1)",
        "tests/geometry/test_degrees.py::test_a_linear_triatomic_has_five_degrees_not_six",
    ),
    Mutation(
        29, "rotor/fluids/motion/thermometers.py",
        "    counts = (degrees.total, degrees.translation, degrees.rotation)\n",
        "    counts, kinetic = (degrees.total,) * 3, Kinetic(kinetic.total_ev / 2, kinetic.total_ev / 2)\n",
        "tests/hard/test_safeguards.py::test_rotation_has_a_temperature_of_its_own",
    ),
    Mutation(
        20, "rotor/thermodynamics/sums/classical_limit.py",
        "(middle**3 / 100 + asymmetric_part)", "(middle**3 / 100)",
        "tests/thermodynamics/test_thermo_functions.py::test_the_next_quantum_correction_is_bounded",
    ),
    Mutation(
        20, "rotor/thermodynamics/sums/level_sums.py",
        "    return np.where(terms == 0, 0.0, np.where(falls, tail, ENDLESS))", "    return 0 * tail",
        "tests/thermodynamics/test_thermo.py::test_error_is_below_what_was_asked",
    ),
    Mutation(
        20, "rotor/thermodynamics/sums/level_sums.py",
        "        done = errors.max(axis=0) < enough[0]\n", "        done = errors.max(axis=0) < np.inf\n",
        "tests/thermodynamics/test_thermo.py::test_error_is_below_what_was_asked",
    ),
    Mutation(
        23, "rotor/quantum/fields/block_states.py",
        " - np.abs(np.transpose(powers)) @ np.array(radii)", "",
        "tests/quantum/fields/test_field_bounds.py::test_the_bound_in_small_cases",
    ),
    Mutation(
        24, "rotor/alignment/align.py",
        "        if jmax_option is not None:\n            raise BasisTooSmallError(",
        "        if jmax_option is not None:\n            return carried(problem, pilot)\n            raise BasisTooSmallError(",
        "tests/alignment/test_alignment.py::test_a_j_max_too_small_is_refused_and_the_one_chosen_is_enough",
    ),
    Mutation(
        24, "rotor/alignment/propagation/steps.py",
        "        if error <= goal:\n", "        if True:\n",
        "tests/hard/test_safeguards.py::test_the_steps_of_a_pulse_are_halved_until_they_agree",
    ),
    Mutation(
        27, "rotor/classical/step_errors.py",
        "if other.steps >= TRIPLED * motion.steps", "if other",
        "tests/scenes/test_error_budgets.py::test_fixed_steps_longer_than_the_times_are_apart_have_an_error",
    ),
    Mutation(
        29, "rotor/fluids/budgets.py",
        "    if settings.every > 1:\n", "    if False:\n",
        "tests/scenes/test_error_budgets.py::test_the_steps_of_a_fluid_are_counted_about_the_mean",
    ),
    Mutation(
        20, "rotor/thermodynamics/sums/level_sums.py",
        "        raise OutOfReachError({t: refusal(t, error, at_worst) for t, error in pairs}, others)", "        return",
        "tests/thermodynamics/test_thermo.py::test_levels_that_distortion_does_not_serve_are_counted_with_their_error",
    ),
    Mutation(
        23, "rotor/quantum/fields/field_map.py",
        "<= request.tolerance_mhz and leaked <= request.most_at_edge", "<= request.tolerance_mhz",
        "tests/hard/test_safeguards.py::test_the_edge_of_a_basis_is_empty_whatever_the_tolerance",
    ),
    Mutation(
        24, "rotor/alignment/align.py",
        "    return trace.step_error * 2 + ", "    return ",
        "tests/scenes/test_stated_bounds.py::test_stated_errors_are_bounds[aligned]",
    ),
    Mutation(
        27, "rotor/classical/exponents.py",
        "    return np.asarray(2 * np.log(", "    return np.asarray(0 * np.log(",
        "tests/classical/test_lyapunov.py::test_closed_forms_are_within_the_stated_errors[free_tumble]",
    ),
    Mutation(
        30, "rotor/classical/free/budget.py",
        "    if shift < 1.0:\n", "    if True:\n",
        "tests/hard/test_hard_cases.py::test_flips_near_the_separatrix_are_not_claimed_after_1e10_periods",
    ),
)  # fmt: skip


def copy_of_package(folder: Path) -> None:
    """The package, its data, its tests and the scripts of its pages, as they are now."""
    left = shutil.ignore_patterns("__pycache__", "*.nbi", "*.nbc", "*.png", "*.md", "site")
    for name in ("rotor", "data", "tests", "docs"):
        shutil.copytree(ROOT / name, folder / name, ignore=left)
    shutil.copy(ROOT / "pyproject.toml", folder)


NO_VERDICT = re.compile(
    r"^E +(NameError|UnboundLocalError|SyntaxError|ImportError|ModuleNotFoundError|FileNotFoundError)", re.M
)


def goes_red(mutation: Mutation, folder: Path, before: bool = True) -> bool:
    """Whether the test passes in the copy and fails without the safeguard; the copy is as before afterwards.

    before: whether the test is run with the safeguard first, which the usual run of all tests does too.
    Raises AssertionError where the text to be replaced is not there exactly once, where the test fails or is skipped beforehand, and
    where what fails is the mutation itself, by a name or a file that does not exist.
    """
    path = folder / mutation.file
    whole = path.read_text(encoding="utf-8")
    assert whole.count(mutation.old) == 1, f"case {mutation.case}: {mutation.file} has changed; write the mutation anew"
    if before:
        code, output = ran(mutation.test, folder)
        assert code == 0, f"case {mutation.case}: {mutation.test} fails already\n{output}"
        assert re.search(r"\d passed", output), f"case {mutation.case}: {mutation.test} does not run here\n{output}"
    path.write_text(whole.replace(mutation.old, mutation.new), encoding="utf-8")
    try:
        code, output = ran(mutation.test, folder)
    finally:
        path.write_text(whole, encoding="utf-8")
    assert not NO_VERDICT.search(output), f"case {mutation.case}: the mutation is at fault, not the test\n{output}"
    return code == 1


def ran(test: str, folder: Path) -> tuple[int, str]:
    """Exit code, 0 or 1, and output of a test in the copy."""
    options = ["-q", "-x", "-p", "no:cacheprovider", "-m", "slow or not slow"]
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-B", "-m", "pytest", *options, test]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    output = done.stdout + done.stderr
    assert done.returncode in (0, 1), output  # 1: tests failed; anything else is no verdict
    return done.returncode, output


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as temporary:
        copy_of_package(Path(temporary))
        chosen = [mutation for mutation in MUTATIONS if not sys.argv[1:] or str(mutation.case) in sys.argv[1:]]
        green = [mutation for mutation in chosen if not goes_red(mutation, Path(temporary))]
    for mutation in green:
        print(f"case {mutation.case}: {mutation.test} stays green without its safeguard")
    sys.exit(bool(green))
