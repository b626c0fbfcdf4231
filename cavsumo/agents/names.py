"""The tester agents that come with cavsumo: each name with the file that registers it."""

from cavsumo.model.names import Names

AGENT_NAMES = Names(
    "agent",
    "cavsumo.agents",
    {
        "best-response": "best_response",
        "election": "election",
        "expectiminimax": "expectiminimax",
        "noop": "base",
        "programmed-random": "programmed",
        "proximity": "programmed",
        "q-learning": "qlearning",
        "random": "random",
        "recorded": "recorded",
        "timing": "programmed",
    },
)
