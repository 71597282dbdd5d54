"""States and operators of tops in fields as QuTiP objects, for open systems, other solvers, and plots of states.

`block_objects` gives a symmetry block (sufficient for pulses along Z), `linear_objects` all |J M⟩ of a linear top with the
operators of isotropic collisions. Energies are in rad/ps, so that times of QuTiP's solvers are in ps and ħ = 1.

QuTiP's solvers adapt their steps to the estimated error. If the times begin long before a pulse, the steps grow until they skip the
pulse: cos²θ then stays 1/3, without a warning. `solve_windows` therefore integrates only the windows of the pulses, with steps limited
to a fraction of the window, and applies exact phases between them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from rotor.alignment.acting import acted_on, guessed_jmax
from rotor.alignment.observables import observable
from rotor.alignment.propagation.timeline import Channel, Window, timeline
from rotor.alignment.pulse import RAD_PER_PS_MHZ, Kick, Pulse
from rotor.arrays import Floats, Ints
from rotor.quantum.fields.axial import cosine_bands
from rotor.quantum.fields.blocks import Contraction
from rotor.quantum.fields.solved_space import field_space
from rotor.quantum.operators.symmetric_top_elements import coupling
from rotor.tops.top import require_single_state

if TYPE_CHECKING:
    from rotor.tops.top import Top

# longest step, as a fraction of a window: half a width of a Gaussian pulse, whose window has seven widths
LONGEST_STEP = 1 / 14
BEST_OPTIONS = {"method": "vern7", "rtol": 1e-10, "atol": 1e-12, "nsteps": 1_000_000, "progress_bar": ""}


@dataclass(frozen=True)
class BlockObjects:
    """One block as Qobj: free energies, the operator of each channel of the pulses, cosines by name; J of the states (n,).

    labels: quantum numbers of the states as text. windows: of the pulses.
    """

    free: Any
    interactions: tuple[tuple[Channel, Any], ...]
    cosines: dict[str, Any]
    j: Ints
    labels: tuple[str, ...]
    windows: tuple[Window, ...]

    def state(self, label: str) -> Any:
        """The free state with a label such as "0" or "1 0 1", as a ket."""
        import qutip

        if label not in self.labels:
            raise ValueError(f"state {label!r}: the block has {', '.join(self.labels[:8])}, ...")
        return qutip.basis(len(self.j), self.labels.index(label))

    def hamiltonian(self, window: Window) -> list[Any]:
        """[H0, [-W, u(t)], ...] for `qutip.sesolve` or `qutip.mesolve`, valid inside the window."""
        return [self.free, *([-_operator(self, channel), _coefficient(channel)] for channel in window.channels)]


def _operator(objects: BlockObjects, channel: Channel) -> Any:
    return next(operator for candidate, operator in objects.interactions if _same(candidate, channel))


def _same(channel: Channel, other: Channel) -> bool:
    return channel.acts_on == other.acts_on and bool(np.abs(channel.space - other.space).max() < 1e-12)


def _coefficient(channel: Channel) -> Callable[[float], float]:
    return lambda t: float(channel.strength(np.array([t]))[0])


def block_objects(
    top: Top,
    pulses: Sequence[Pulse],
    *,
    m: int = 0,
    block: int = 0,
    jmax: int | None = None,
    cosines: Sequence[str] = ("cos2theta",),
) -> BlockObjects:
    """A symmetry block (number `block` of those with |M| = `m`) that the pulses do not couple to others, as QuTiP objects.

    Parameters
    ----------
    top : Top
        With the property that the pulses act on.
    pulses : sequence of Pulse
        In order of time.
    m : int, optional
        |M| of the block.
    block : int, optional
        Its number among those of this |M|, from 0.
    jmax : int, optional
        Highest J. Default: as needed for these pulses from J = 0.
    cosines : sequence of str, optional
        Names of the observables.

    Returns
    -------
    BlockObjects
        Free Hamiltonian and interactions in rad/ps, cosines, J and labels of the states.

    Raises
    ------
    ValueError
        For a block that does not exist.
    """
    import qutip

    windows = timeline(pulses)
    channels: list[Channel] = []
    for channel in (each for window in windows for each in window.channels):
        if not any(_same(listed, channel) for listed in channels):
            channels.append(channel)
    contractions = [Contraction(acted_on(top, each.acts_on), each.space) for each in channels]
    space = field_space(
        require_single_state(top, "alignment"),
        guessed_jmax(top, pulses, 0, 1e-10) if jmax is None else jmax,
        contractions,
    )
    blocks = space.blocks(m)
    if not 0 <= block < len(blocks):
        raise ValueError(f"block {block} of |M| = {m}: there are {len(blocks)}, numbered from 0")
    chosen = blocks[block]

    def quantum_object(matrix: Any) -> Any:
        return qutip.Qobj(matrix if isinstance(matrix, np.ndarray) else matrix.tocsr())

    return BlockObjects(
        free=qutip.qdiags(RAD_PER_PS_MHZ * chosen.energies_mhz, 0),
        interactions=tuple(
            (channel, quantum_object(chosen.matrix(contraction)))
            for channel, contraction in zip(channels, contractions, strict=True)
        ),
        cosines={name: quantum_object(observable(name, top).matrix(chosen)) for name in cosines},
        j=chosen.j,
        labels=tuple(space.levels.label(int(row)) for row in chosen.rows),
        windows=windows,
    )


def solve_windows(
    objects: BlockObjects, ket: Any, times_ps: ArrayLike, *, options: dict[str, Any] | None = None
) -> dict[str, Floats]:
    """Cosines of a pure state: `qutip.sesolve` during the pulses, exact phases otherwise.

    Parameters
    ----------
    objects : BlockObjects
        From `block_objects`.
    ket : qutip.Qobj
        The state before the first pulse.
    times_ps : (t,) array
        Increasing.
    options : dict, optional
        Options of sesolve, instead of `BEST_OPTIONS`; max_step is always set.

    Returns
    -------
    dict of str to (t,) array
        By the names of the observables.
    """
    import qutip

    times = np.asarray(times_ps, dtype=np.float64)
    energies = objects.free.diag().real
    out = {name: np.full(len(times), np.nan) for name in objects.cosines}
    now = min(objects.windows[0].start_ps, float(times[0]))
    for number, window in enumerate(objects.windows):
        _fill_free(objects, energies, ket, now, times, (-np.inf if number == 0 else now, window.start_ps), out)
        ket = qutip.Qobj(np.exp(-1j * energies * (window.start_ps - now))[:, None] * ket.full())
        ket = _through(objects, window, ket, times, out, options)
        now = window.stop_ps
    _fill_free(objects, energies, ket, now, times, (now, np.inf), out)
    return out


def _through(
    objects: BlockObjects,
    window: Window,
    ket: Any,
    times: Floats,
    out: dict[str, Floats],
    options: dict[str, Any] | None,
) -> Any:
    import qutip

    kick = window.channels[0].pulses[0]
    if isinstance(kick, Kick):
        return (1j * kick.area * _operator(objects, window.channels[0])).expm() * ket
    inside = np.flatnonzero((times > window.start_ps) & (times < window.stop_ps))
    listed = np.concatenate([[window.start_ps], times[inside], [window.stop_ps]])
    chosen = {
        **(options or BEST_OPTIONS),
        "max_step": LONGEST_STEP * (window.stop_ps - window.start_ps),
        "store_states": True,
    }
    solved = qutip.sesolve(
        objects.hamiltonian(window), ket, listed, e_ops=list(objects.cosines.values()), options=chosen
    )
    for name, values in zip(objects.cosines, solved.expect, strict=True):
        out[name][inside] = np.real(values[1:-1])
    return solved.states[-1]


def _fill_free(
    objects: BlockObjects,
    energies: Floats,
    ket: Any,
    now: float,
    times: Floats,
    between: tuple[float, float],
    out: dict[str, Floats],
) -> None:
    """Write expectation values at the times from `between[0]` to `between[1]`, for free evolution of a state at time `now`."""
    here = np.flatnonzero((times >= between[0]) & (times <= between[1]))
    states = np.exp(-1j * np.multiply.outer(energies, times[here] - now)) * ket.full()
    for name, operator in objects.cosines.items():
        matrix = operator.data_as("csr_matrix") if operator.dtype.__name__ == "CSR" else operator.full()
        out[name][here] = np.einsum("nt,nt->t", states.conj(), matrix @ states).real


@dataclass(frozen=True)
class LinearObjects:
    """All |J M⟩ of a linear top up to J max, in order of J and M, as Qobj with dims [[n], [n]].

    free: energies in rad/ps. cosine, cosine_squared: of the angle with Z. turns: D^1_p0, p = -1, 0, 1, the operators of isotropic
    collisions that change J and M by at most 1.
    """

    free: Any
    cosine: Any
    cosine_squared: Any
    turns: tuple[Any, Any, Any]
    j: Ints
    m: Ints

    def thermal(self, temperature_k: float) -> Any:
        """The density matrix at a temperature, without spin weights."""
        import qutip

        kelvin = self.free.diag().real / RAD_PER_PS_MHZ / 20836.619123327576
        population = np.exp(-(kelvin - kelvin.min()) / temperature_k)
        return qutip.qdiags(population / population.sum(), 0)

    def collisions(self, rate_per_ps: float) -> list[Any]:
        """Collapse operators √γ D^1_p0 for `qutip.mesolve`, with the collision rate γ."""
        if not (np.isfinite(rate_per_ps) and rate_per_ps >= 0):
            raise ValueError(f"rate {rate_per_ps} per ps: a finite number of 0 or more is expected")
        return [np.sqrt(rate_per_ps) * turn for turn in self.turns]


def linear_objects(top: Top, jmax: int) -> LinearObjects:
    """A linear top up to `jmax` for density matrices; it has (J max + 1)² states, so that mesolve is limited to J max of about 15.

    >>> from rotor.tops.top import Top
    >>> linear_objects(Top.from_constants("B=6000 MHz"), 1).free.dims
    [[4], [4]]
    """
    import qutip

    from rotor.quantum.solve import solve_levels

    if top.kind != "linear":
        raise ValueError(f"{top.name or 'this top'} is not linear; block_objects serves every top")
    energies = solve_levels(top, jmax).energy_mhz
    j = np.repeat(np.arange(jmax + 1), 2 * np.arange(jmax + 1) + 1)
    m = np.concatenate([np.arange(-value, value + 1) for value in range(jmax + 1)])
    longer = _turn(jmax + 1, 0)
    size = (jmax + 1) ** 2
    return LinearObjects(
        free=qutip.qdiags(RAD_PER_PS_MHZ * energies[j], 0),
        cosine=qutip.Qobj(longer[:size, :size]),
        cosine_squared=qutip.Qobj((longer @ longer)[:size, :size]),
        turns=(qutip.Qobj(_turn(jmax, -1)), qutip.Qobj(_turn(jmax, 0)), qutip.Qobj(_turn(jmax, 1))),
        j=j,
        m=m,
    )


def _turn(jmax: int, p: int) -> Any:
    """⟨J' M+p|D^1_p0|J M⟩ over all |J M⟩, sparse: the space-fixed component p of the unit vector along the axis."""
    from scipy.sparse import coo_array

    rows, columns, values = [], [], []
    for low in range(jmax + 1):
        for up in (low - 1, low + 1):
            if not 0 <= up <= jmax:
                continue
            m = np.arange(-low, low + 1)
            m = m[np.abs(m + p) <= up]
            body = float(coupling(low, up, 1, 0, 0))
            rows.append(up * up + up + m + p)
            columns.append(low * low + low + m)
            values.append(coupling(low, up, 1, p, m) * body / np.sqrt((2.0 * up + 1) * (2 * low + 1)))
    size = (jmax + 1) ** 2
    return coo_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(size, size)
    ).tocsr()


def cosine_chain(jmax: int, k: int, m: int) -> Any:
    """cosθ over |J k M⟩, J = max(|k|, |M|) ... J max, as a Qobj.

    >>> cosine_chain(1, 0, 0).full().real.round(6).tolist()
    [[0.0, 0.57735], [0.57735, 0.0]]
    """
    import qutip

    diagonal, beside = cosine_bands(1, max(abs(k), abs(m)), jmax, 1, k, m)
    return qutip.qdiags([beside, diagonal, beside], [-1, 0, 1])
