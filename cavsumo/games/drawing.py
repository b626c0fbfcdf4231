"""The tree of a game for its picture: nodes, edges and their positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cavsumo.games.model import Game
from cavsumo.games.readings import Reading

LIMIT = 160  # leaves of a tree that can still be read


@dataclass
class Node:
    """A node of the tree.

    Attributes:
        kind: "state", "goal", "again" (a state drawn above), "ego" or "chance".
        text: inside it.
        edge: beside the edge that leads to it.
        chosen: whether the policies take that edge.
        children: below it.
        x, depth: where it stands; x counts leaves.
    """

    kind: str
    text: str = ""
    edge: str = ""
    chosen: bool = False
    children: list[Node] = field(default_factory=list)
    x: float = 0.0
    depth: int = 0


Taken = Callable[[int], tuple[bool, bool]]  # a cell to whether tester and ego play it


def tree(game: Game, reading: Reading, taken: Taken) -> Node:
    """The game unfolded from its initial state: tester, ego, chance; each state once.

    In reading C the ego's choice stands above the tester's.
    """
    seen: set[int] = set()

    def state_node(state: int, edge: str, chosen: bool) -> Node:
        if game.goal[state]:
            return Node("goal", game.label(state), edge, chosen)
        if state in seen:
            return Node("again", game.label(state), edge, chosen)
        seen.add(state)
        return Node("state", game.label(state), edge, chosen)

    root = state_node(game.initial, "", True)
    waiting = [(root, game.initial)]
    while waiting:  # breadth first, so that a state is unfolded where it is met first
        node, state = waiting.pop(0)
        for choice in _choices(game, reading, state, taken):
            node.children.append(choice)
            for answer in choice.children or [choice]:
                cell = int(answer.text)
                answer.text = ""
                for successor, p, r in game.outcomes(cell):
                    child = state_node(successor, _outcome(p, r), answer.chosen and choice.chosen)
                    answer.children.append(child)
                    if child.kind == "state":
                        waiting.append((child, successor))
    _place(root)
    return root


def _choices(game: Game, reading: Reading, state: int, taken: Taken) -> list[Node]:
    """The first mover's choices in a state, below them the answers; cells stand in their text."""
    tester_first = reading is not Reading.C
    first = game.tester_action[game.cell_row] if tester_first else game.ego_action
    second = game.ego_action if tester_first else game.tester_action[game.cell_row]
    cells = [cell for row in game.rows(state) for cell in game.cells(row)]
    found = []
    for action in sorted({int(first[cell]) for cell in cells}):
        own = [cell for cell in cells if first[cell] == action]
        lead = [taken(cell)[0 if tester_first else 1] for cell in own]
        choice = Node("ego" if tester_first else "tester", "", str(action), any(lead))
        for cell in own:
            answered = taken(cell)[1 if tester_first else 0]
            choice.children.append(Node("chance", str(cell), str(int(second[cell])), answered))
        found.append(choice)
    return found


def _outcome(probability: float, reward: float) -> str:
    """An edge of chance: its probability if it is not certain, and the reward."""
    sure = abs(probability - 1.0) < 1e-12
    return (f"{reward:.3g}" if sure else f"{probability:.3g}; {reward:.3g}").replace("-", "\u2212")


def _place(root: Node) -> None:
    """Leaves side by side, every other node above the middle of its children."""
    leaves = 0

    def place(node: Node, depth: int) -> None:
        nonlocal leaves
        node.depth = depth
        for child in node.children:
            place(child, depth + 1)
        if node.children:
            node.x = (node.children[0].x + node.children[-1].x) / 2
        else:
            node.x = leaves
            leaves += 1

    place(root, 0)


def size(node: Node) -> tuple[int, int]:
    """Leaves and depth of a tree."""
    if not node.children:
        return 1, node.depth
    parts = [size(child) for child in node.children]
    return sum(leaves for leaves, _ in parts), max(depth for _, depth in parts)
