"""Model of the queue of blocks, clock by clock, and the plan that it must arrive at."""

from collections.abc import Sequence

__all__ = ["BlockQueueModel", "junctions", "plan"]


def plan(blocks: Sequence[tuple[int, int]]) -> list[int]:
    """Return the entries of blocks, each of a limit and a gain: the backward pass, in full."""
    entries, after = [], 0
    for limit, gain in reversed(blocks):
        after = min(limit, after + gain)
        entries.append(after)
    return entries[::-1]


def junctions(blocks: Sequence[tuple[int, int]], first: int = 0) -> list[int]:
    """Return w at every entry and at the end, from `first` on: the backward and forward pass."""
    entries = [*plan(blocks), 0]
    reached = [min(first, entries[0])]
    for (_, gain), entry in zip(blocks, entries[1:], strict=True):
        reached.append(min(entry, reached[-1] + gain))
    return reached


class BlockQueueModel:
    """The queue in whole numbers: blocks have numbers, and a place is used again after `depth`.

    Parameters
    ----------
    depth, words, word : int
        Those of the queue.

    Attributes
    ----------
    head, tail : int
        Numbers of the oldest block in the queue, and of the one that is written.
    """

    def __init__(self, *, depth: int = 64, words: int = 16, word: int = 36) -> None:
        self.depth, self.words, self.word = depth, words, word
        self._places = [[0] * (words + 4) for _ in range(depth)]
        self._entries = [0] * depth
        self.reset()

    def reset(self) -> None:
        """Forget all blocks, and begin the schedule; memories keep their words."""
        self._clock = 0
        self.head = self.tail = 0
        self.exit = self.next_exit = 0
        self._adding = False
        self._pass: int | None = None  # number of the block that is computed
        self._after = 0
        self._refreshed: int | None = None
        self._read = 0
        self._stages: list[tuple[int, bool] | None] = [None, None]
        self._read_out = False
        self._accepts = True

    @property
    def count(self) -> int:
        """Blocks in the queue."""
        return self.tail - self.head

    @property
    def planning(self) -> bool:
        """Whether a pass is to be made, or under way."""
        return self._adding or self._pass is not None

    @property
    def ready(self) -> bool:
        """Whether a word is accepted: not in the first clock in which it could be, either."""
        return self._accepts and not self._adding

    @property
    def offered(self) -> tuple[int, bool] | None:
        """The word that is offered, and whether it is the last one; None if there is none."""
        return self._stages[1]

    def outputs(self) -> dict[str, int]:
        """Return the outputs in this clock; a word that is not offered is left out."""
        values = {"write_ready": self.ready, "blocks_valid": self.offered is not None,
                  "exit": self.exit, "next_exit": self.next_exit, "count": self.count,
                  "free": self.depth - self.count, "empty": not self.count and not self._adding}
        if self.offered is not None:
            values["blocks_payload"] = self.offered[0] | self.offered[1] << self.word
        return {name: int(value) for name, value in values.items()}

    def edge(self, *, write: tuple[int, int, bool] | None = None, ready: bool = False,
             take: bool = False, flush: bool = False) -> None:
        """Go to the next clock.

        Parameters
        ----------
        write : tuple, optional
            Address, data and `last` that are offered to the queue.
        ready : bool
            The reader accepts a word.
        take, flush : bool
            Inputs of those names.
        """
        taken, tail, shown = take and self._read_out, self.tail, self.next_exit
        accepted = write if self.ready else None
        self._accepts = not self.planning and self.count < self.depth
        begins = self._adding and self._pass is None and self._clock % 8 == 0
        self._reader(ready)
        self._step()
        self._refresh(taken)
        if accepted:
            address, data, last = accepted
            self._places[self.tail % self.depth][address] = data
            self._adding = bool(last)
        if begins:
            self._pass, self._after = self.tail, 0
        if taken:
            self.head += 1
            self.exit, self.next_exit = shown, 0
        if taken or flush:
            self._read_out, self._read = False, 0
        if flush:
            self.head = self.tail = tail
            self.exit = self.next_exit = 0
            self._adding, self._pass, self._refreshed = False, None, None
            self._stages = [None, None]
        self._clock += 1

    def _reader(self, ready: bool) -> None:
        offered = self.offered
        if offered and not ready:
            return
        self._read_out |= bool(offered and offered[1])
        self._stages[1] = self._stages[0]
        self._stages[0] = None
        if self.count and self._read < self.words:
            word = self._places[self.head % self.depth][self._read]
            self._read += 1
            self._stages[0] = word, self._read == self.words

    def _step(self) -> None:
        """End the computation of a block, in the first of eight clocks."""
        number = self._pass
        if number is None or self._clock % 8:
            return
        place = number % self.depth
        gain = sum(part << at * self.word
                   for at, part in enumerate(self._places[place][self.words:self.words + 2]))
        limit = sum(part << at * self.word
                    for at, part in enumerate(self._places[place][self.words + 2:]))
        entry = min(limit, self._after + gain)
        same = entry == self._entries[place] and not self._adding
        if number >= self.head:
            self._entries[place] = entry
        self._after = entry
        self._pass = None if same or number <= self.head else number - 1
        if self._adding:
            self._adding = False
            self.tail += 1

    def _refresh(self, taken: bool) -> None:
        """Read the entry of the oldest block and of the second, in alternation."""
        phase, second = self._clock % 8, (self._clock // 8 + 1) % 2
        if phase == 6:
            self._refreshed = (self._entries[(self.head + second) % self.depth]
                               if self.count > second else None)
        if phase == 1 and self._refreshed is not None:
            if second:
                self.exit = self._refreshed
            else:
                self.next_exit = self._refreshed
        if taken or phase == 1:
            self._refreshed = None
