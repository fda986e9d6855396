"""The puzzle on bare text such as RR|GG|PP, independent of the package: what tests check it against."""
from collections import deque


def moves(text):
    """Yield (source, target, text after) of every one-ball pour, working on the bare text."""
    tubes = text.split("|")
    for source in range(3):
        for target in range(3):
            if source != target and tubes[source] and len(tubes[target]) < 4:
                after = list(tubes)
                after[target] += after[source][-1]
                after[source] = after[source][:-1]
                yield source, target, "|".join(after)


def distances(text, allowed=lambda text: True):
    """Return the number of pours to every state that can be reached through allowed ones, by breadth-first search."""
    found, queue = {text: 0}, deque([text])
    while queue:
        here = queue.popleft()
        for _, _, after in moves(here):
            if after not in found and allowed(after):
                found[after] = found[here] + 1
                queue.append(after)
    return found
