"""How independent pieces of work are done: one after the other, or side by side on threads.

Arrays are large enough that threads, which share Python's interpreter, leave it to the others most of the time. Results
come in the order of the items, so they do not hang on how many threads there are.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

A = TypeVar("A")
B = TypeVar("B")


class Each(Protocol):
    """`map`, or that of a `concurrent.futures.Executor`."""

    def __call__(self, function: Callable[[A], B], items: Iterable[A], /) -> Iterator[B]:
        """The results of a function for each item, in their order."""
