"""The states of a Markov chain that can reach its last state, from its graph without floats."""

from __future__ import annotations

from typing import Any

import numpy as np

from cavsumo.games.model import Bools


def reaching(transitions: Any, fast: bool = False) -> Bools:
    """The states from which the last state can be reached, itself included.

    Args:
        transitions: P as CSR, square, its stored entries positive.
        fast: by compiled loops.
    """
    if fast:
        from cavsumo.games.compiled import graphs

        compiled: Bools = graphs.reaching(transitions.indptr, transitions.indices)
        return compiled
    from scipy.sparse.csgraph import breadth_first_order

    last = transitions.shape[0] - 1
    found = np.zeros(last + 1, dtype=bool)
    backward = transitions.T.tocsr()
    found[breadth_first_order(backward, last, directed=True, return_predecessors=False)] = True
    return found
