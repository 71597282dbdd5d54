"""Names given to states one to one, so that the sum of the overlaps is largest.

Where every state has a function of its own that it overlaps with most, that is the answer. For the few others shortest paths in the
graph of functions and states move names to where the sum loses least (H. W. Kuhn, Naval Res. Logist. Q. 2 (1955) 83; with
potentials as J. Edmonds and R. M. Karp, J. ACM 19 (1972) 248).
"""

from __future__ import annotations

import numpy as np

from rotor.arrays import Floats, Ints


def match_names(overlaps: Floats) -> Ints:
    """Which function names each state: (n,) rows of `overlaps` (functions, states), each once, their sum largest.

    >>> match_names(np.array([[0.9, 0.8, 0.0], [0.1, 0.2, 0.3], [0.0, 0.0, 0.7]])).tolist()
    [0, 1, 2]
    """
    clear = overlaps.argmax(axis=0)
    count = len(clear)
    if len(set(clear.tolist())) == count:
        return np.asarray(clear)
    loss = overlaps.max(axis=0)[None, :] - overlaps  # never below 0
    potential = np.zeros(count)  # of the functions; of the states the largest overlap is taken off above
    state_of_function, function_of_state = np.full(count, -1), np.full(count, -1)
    for state, function in enumerate(clear.tolist()):
        if state_of_function[function] < 0:
            state_of_function[function], function_of_state[state] = state, function
    lifted = np.zeros(count)  # potentials of the states
    for state in np.flatnonzero(function_of_state < 0).tolist():
        _augmented(state, loss, potential, lifted, state_of_function, function_of_state)
    return function_of_state


def _augmented(
    state: int, loss: Floats, potential: Floats, lifted: Floats, state_of_function: Ints, function_of_state: Ints
) -> None:
    """One more state has a name, by the way of least loss; the arrays are changed."""
    count = len(function_of_state)
    distance, before = np.full(count, np.inf), np.full(count, -1)
    done = np.zeros(count, dtype=bool)
    here, least, seen = state, 0.0, [state]
    while True:
        ways = least + loss[:, here] - lifted[here] - potential
        shorter = ~done & (ways < distance)
        distance[shorter], before[shorter] = ways[shorter], here
        function = int(np.where(done, np.inf, distance).argmin())
        least = float(distance[function])
        done[function] = True
        if state_of_function[function] < 0:
            break
        here = int(state_of_function[function])
        seen.append(here)
    reached = [int(function_of_state[function_seen]) for function_seen in seen[1:]]
    potential[reached] += distance[reached] - least
    lifted[seen] += least - np.array([0.0, *distance[reached]])
    while True:
        previous = int(before[function])
        state_of_function[function] = previous
        function, function_of_state[previous] = int(function_of_state[previous]), function
        if previous == state:
            return
