"""Best-first search for ways through a graph whose steps are tested only when they are about to be taken."""

import heapq
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Generic, TypeVar

Node = TypeVar("Node")


@dataclass(frozen=True, eq=False)
class Graph(Generic[Node]):
    """What a cheap search knows of nodes.

    Attributes:
        ahead: Estimate of the cost from a node to the goal.
        followers: Nodes after one, with the cost of each.
        tested: What a step to a node costs beyond that, infinite where it is not possible; asked when the
            step is about to be taken, with the node before both where there is one.
        ended: Whether a node is a goal.
    """

    ahead: Callable[[Node], float]
    followers: Callable[[Node], Iterable[tuple[Node, float]]]
    tested: Callable[[Node | None, Node, Node], float]
    ended: Callable[[Node], bool]

    def best(
        self, starts: Sequence[Node], greeds: Sequence[tuple[float, int]]
    ) -> tuple[list[Node] | None, list[int]]:
        """Nodes of the best way to a goal, or None, and how many were expanded with each factor.

        Each factor on the estimate goes with the nodes that may be expanded with it; they are tried in turn.
        """
        expanded: list[int] = []
        for greed, most in greeds:
            way, count = self._search(starts, greed, most)
            expanded.append(count)
            if way is not None or count < most:
                return way, expanded
        return None, expanded

    def _search(self, starts: Sequence[Node], greed: float, most: int) -> tuple[list[Node] | None, int]:
        """A way with one factor on the estimate, and how many nodes were expanded; fewer than most: all."""
        open_: list[tuple[float, int, float, Node, Node | None, bool]] = []
        parents: dict[Node, Node | None] = {}
        numbers, expanded = count(), 0

        def push(total: float, node: Node, parent: Node | None, tested: bool) -> None:
            entry = (total + greed * self.ahead(node), next(numbers), total, node, parent, tested)
            heapq.heappush(open_, entry)

        for node in starts:
            push(0.0, node, None, True)
        while open_:
            _, _, cost, node, parent, tested = heapq.heappop(open_)
            if node in parents:
                continue
            if not tested and parent is not None:
                total = cost + self.tested(parents[parent], parent, node)
                if math.isfinite(total):
                    push(total, node, parent, True)
                continue
            parents[node] = parent
            if self.ended(node):
                way = [node]
                while (before := parents[way[-1]]) is not None:
                    way.append(before)
                return way[::-1], expanded
            if expanded == most:
                return None, expanded
            expanded += 1
            for after, step in self.followers(node):
                if after not in parents:
                    push(cost + step, after, node, False)
        return None, min(expanded, most - 1)
