"""Two-player stochastic shortest path games, solved with certificates; independent of traffic."""

from cavsumo.games.build import from_arrays, from_callable, from_transitions
from cavsumo.games.certificate import Certificate, holds, holds_exactly
from cavsumo.games.evaluation import (
    expected_value,
    least_reach_probability,
    reach_probability,
    stationary_values,
)
from cavsumo.games.files import read_game
from cavsumo.games.model import Game, GameError
from cavsumo.games.policies import (
    Execution,
    History,
    HistoryDependent,
    Markovian,
    Policy,
    Stationary,
    execute,
    histories,
    is_markovian,
    is_pure,
    is_stationary,
    pure,
    uniform,
)
from cavsumo.games.proper import is_proper, literally_solvable, proper_states, sure_steps
from cavsumo.games.readings import Reading
from cavsumo.games.regions import Region, almost_sure_region, sure_region
from cavsumo.games.solvable import Solvability, solvability
from cavsumo.games.solve import NotCertified, Solution, Unsolvable, solve

__all__ = [
    "Certificate",
    "Execution",
    "Game",
    "GameError",
    "History",
    "HistoryDependent",
    "Markovian",
    "NotCertified",
    "Policy",
    "Reading",
    "Region",
    "Solution",
    "Solvability",
    "Stationary",
    "Unsolvable",
    "almost_sure_region",
    "execute",
    "expected_value",
    "from_arrays",
    "from_callable",
    "from_transitions",
    "histories",
    "holds",
    "holds_exactly",
    "is_markovian",
    "is_proper",
    "is_pure",
    "is_stationary",
    "least_reach_probability",
    "literally_solvable",
    "proper_states",
    "pure",
    "reach_probability",
    "read_game",
    "solvability",
    "solve",
    "stationary_values",
    "sure_region",
    "sure_steps",
    "uniform",
]
