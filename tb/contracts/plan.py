"""Contract of the queue of blocks: every entry is one that can be kept, and none is taken back."""

from amaranth import Array, Cat, Const, Mux

from fresa.motion import BlockQueue

from .contract import Bits, Case, Component, Contract

__all__ = ["PLAN"]

ENUMERATED = 8
"""Largest depth for which the plan of every place is stated."""

FOLLOWS = 20
"""Clocks within which an exit follows."""


def describe(c: Contract, dut: BlockQueue) -> None:
    """Blocks are a queue; entries are those of the backward pass; exits are entries."""
    # Bits of a limit above those of w are 0.
    spare = dut.write.p.data >> dut.width - dut.word
    c.assume(~dut.write.valid | (dut.write.p.address != dut.limit + 1) | (spare == 0))
    c.assume(~dut.write.valid | (dut.write.p.address < dut.words + 4))
    c.restrict_covers(~c.rst & dut.write.valid)
    _queue(c, dut)
    _pass(c, dut)
    if dut.depth <= ENUMERATED:
        _words(c, dut)
        places = _Places(c, dut)
        _arithmetic(c, dut, places)
        _entries(c, dut, places)
        _exits(c, dut, places)


def _queue(c: Contract, dut: BlockQueue) -> None:
    """State what is accepted, counted and dropped."""
    head, tail, count = c.signal("head"), c.signal("tail"), dut.count
    adding, active, taken = c.signal("adding"), c.signal("active"), c.signal("taken")
    accepted = dut.write.valid & dut.write.ready
    given = dut.blocks.valid & dut.blocks.ready
    dropped = c.rst | dut.flush

    waiting = c.keep(range(dut.depth + 1), name="waiting")  # committed, and not begun
    words = c.keep(range(dut.words + 1), name="words_read")
    begins = dut.take & (words == dut.words)
    c.m.d.sync += [waiting.eq(waiting + (accepted & dut.write.p.last) - begins),
                   words.eq(Mux(begins, 0, words + given))]
    with c.m.If(dropped):
        c.m.d.sync += [waiting.eq(0), words.eq(0)]
    c.invariant("counted", "Blocks are counted from when their entry is computed until they are "
                "taken; none is lost or counted twice.", count + adding == waiting,
                cover=count == 2)
    c.invariant("free-and-empty", "The other counts are those of the queue.",
                (dut.free + count == dut.depth) & (dut.empty == (waiting == 0)),
                cover=dut.empty & c.past(c.past(~dut.empty)))
    c.implication("never-overflows", "No word is accepted without a place for a block, nor during "
                  "a pass.", when=accepted, then=(waiting < dut.depth) & ~active)
    open_ = ~active & ~adding & (waiting < dut.depth)
    c.implication("accepts", "While no pass is made and there is a place, words are accepted, but "
                  "in the first clock.", when=~active & ~adding & c.past(open_),
                  then=dut.write.ready)
    c.implication("accepts-with-a-place", "Nothing but a block that is committed ends that.",
                  when=c.signal("accepts"), then=~active & (count < dut.depth), lemma=True)
    c.implication("flush-drops-all", "After a flush nothing is in the queue, and nothing is "
                  "offered.", when=c.past(dropped, init=1),
                  then=(count == 0) & dut.empty & ~dut.blocks.valid & (dut.exit == 0)
                  & (dut.next_exit == 0))
    c.invariant("take-after-words", "A block is taken once all its words are read, and not before.",
                taken == begins, cover=taken)
    c.implication("blocks-of-the-queue", "Words are offered of blocks in the queue only, and none "
                  "after the last one of a block until it is taken.", when=dut.blocks.valid,
                  then=(count != 0) & (words != dut.words)
                  & (dut.blocks.p.last == (words == dut.words - 1)))
    c.implication("stable-until-ready", "A word that is offered stays, until it is read or "
                  "dropped.", when=c.past(dut.blocks.valid & ~dut.blocks.ready & ~dropped),
                  then=dut.blocks.valid & (dut.blocks.payload.as_value()
                                           == c.past(dut.blocks.payload.as_value())))
    begun = c.past(c.past((count != 0) & ~taken & ~dropped) & ~taken & ~dropped)
    c.implication("offers", "Words are offered from the third clock on in which their block is the "
                  "oldest, one a clock.", when=begun,
                  then=dut.blocks.valid | (words == dut.words))
    requested, place = c.signal("requested"), c.signal("place")
    fetched = c.signal("fetched")
    c.invariant("pointers", "The newest block ends where the next is written.",
                (tail == (head + count)[:len(head)]) & (count <= dut.depth)
                & ~(adding & (count == dut.depth)) & (c.signal("read_out") == (words == dut.words)),
                cover=count != 0, lemma=True)
    c.invariant("words-in-the-registers", "Words on the way are those that were requested.",
                (Mux(requested, dut.words, place) == words + dut.blocks.valid + fetched)
                & (~requested | (place == 0)) & ((count != 0) | ~requested & (place == 0))
                & (~fetched | (c.signal("fetched_last") == requested))
                & (fetched | requested | ~dut.blocks.valid
                   & ~c.past((count != 0) & ~taken & ~dropped)),
                cover=fetched, lemma=True)


def _pass(c: Contract, dut: BlockQueue) -> None:
    """State which block is computed, and for how long."""
    head, count, phase = c.signal("head"), dut.count, c.signal("phase")
    adding, active, left = c.signal("adding"), c.signal("active"), c.signal("left")
    clock, computed, index = phase[:3], c.signal("computed"), c.signal("index")
    current = (head + left)[:len(head)]
    age = c.keep(range(8 * dut.depth + 16), name="clocks_of_pass")
    c.m.d.sync += age.eq(age + 1)
    with c.m.If(c.rst | dut.flush | ~adding & ~active):
        c.m.d.sync += age.eq(0)
    with c.m.If(~adding & ~active & ~c.rst & ~dut.flush & dut.write.valid & dut.write.ready
                & dut.write.p.last):
        c.m.d.sync += age.eq(1)
    c.implication("bounded", "A pass is over after 8 clocks a block and 8 more.",
                  when=adding | active, then=(age != 0) & (age <= 8 * dut.depth + 8))
    newer = Mux(adding, 0, count - 1 - left)
    limit = Mux(active, 8 * newer + 8, 0) + (clock - 1)[:3] + 1
    c.implication("clocks-of-pass", "Each block of it took 8 clocks.", when=adding | active,
                  then=age <= limit, lemma=True)
    c.implication("computed-in-the-queue", "The block that is computed is the new one, or an older "
                  "one, or was the oldest and is taken.", when=active,
                  then=Mux(adding, left == count, (left + 2 <= count)
                           & (left + dut.depth >= count)), lemma=True)
    c.implication("index", "The block that is read is the one that is computed.",
                  when=active, then=Mux(clock == 0, (index == (current - 1)[:len(head)])
                                        & (computed == current),
                                        (index == current)
                                        & ((clock != 7) | (computed == current))), lemma=True)
    c.implication("index-of-the-new", "A pass begins at the new block.",
                  when=(clock == 0) & adding & ~active, then=index == c.signal("tail"), lemma=True)
    plan = c.part("plan")
    write, read = plan.write_ports[0], plan.read_ports[0]
    c.implication("no-collision", "No word of the plan that counts is read in the clock in which "
                  "it is written: only those of a block that is not committed are.",
                  when=write.en & (active | adding | read.addr[2]), then=write.addr != read.addr)
    place = write.addr[3:]
    c.implication("kept-once-begun", "The plan is written of the new block, and entries of those "
                  "in the queue: none of a block that was taken.", when=write.en,
                  then=(place == c.signal("tail")) & (dut.count != dut.depth)
                  | (write.addr[1:3] == 2)
                  & ((place - head)[:len(head)] < dut.count))


def _words(c: Contract, dut: BlockQueue) -> None:
    """A committed block, any of them, is watched until it is taken."""
    accepted = dut.write.valid & dut.write.ready
    address, taken = dut.write.p.address, c.signal("taken")
    chosen = c.free(1, name="watch")
    written = [(c.keep(1, name=f"has_{at}"), c.keep(dut.word, name=f"written_{at}"))
               for at in range(dut.words)]
    block = [(c.keep(1, name=f"knows_{at}"), c.keep(dut.word, name=f"block_{at}"))
             for at in range(dut.words)]
    watched, ahead = c.keep(1, name="watched"), c.keep(range(dut.depth), name="ahead")
    commits = accepted & dut.write.p.last
    chooses = commits & chosen & ~watched
    for at, ((has, word), (knows, kept)) in enumerate(zip(written, block, strict=True)):
        here = accepted & (address == at)
        with c.m.If(here):
            c.m.d.sync += [has.eq(1), word.eq(dut.write.p.data)]
        with c.m.If(chooses):
            c.m.d.sync += [knows.eq(has | here), kept.eq(Mux(here, dut.write.p.data, word))]
        with c.m.If(commits | c.rst):
            c.m.d.sync += has.eq(0)
    with c.m.If(taken):
        c.m.d.sync += ahead.eq(ahead - 1)
        with c.m.If(ahead == 0):
            c.m.d.sync += watched.eq(0)
    with c.m.If(chooses):
        c.m.d.sync += [watched.eq(1), ahead.eq(dut.count - taken)]
    with c.m.If(dut.flush | c.rst):
        c.m.d.sync += watched.eq(0)

    words = c.kept["words_read"]
    c.implication("as-written", "The words of a block are offered as they were written, in the "
                  "order of their addresses, when those before it are taken.",
                  when=dut.blocks.valid & watched & (ahead == 0)
                  & Array(knows for knows, _ in block)[words],
                  then=dut.blocks.p.data == Array(kept for _, kept in block)[words])
    memory = c.words("memory")
    head, tail = c.signal("head"), c.signal("tail")
    slot = (head + ahead)[:len(head)]
    fetched = c.part("memory").read_ports[0].data
    behind = (words + dut.blocks.valid)[:len(Const(dut.words - 1))]
    c.implication("in-memory", "The watched block is in its place in memory.", when=watched,
                  then=(ahead < dut.count + c.signal("adding"))
                  & Cat(~knows | (_of(memory, slot, at, dut.words) == kept)
                        for at, (knows, kept) in enumerate(block)).all(), lemma=True)
    c.implication("in-the-register", "So is its word that was read.",
                  when=watched & (ahead == 0) & c.signal("fetched")
                  & Array(knows for knows, _ in block)[behind],
                  then=fetched == Array(kept for _, kept in block)[behind], lemma=True)
    c.invariant("written", "What is written is in the place of the next block.",
                Cat(~has | ~c.signal("adding") & (_of(memory, tail, at, dut.words) == word)
                    for at, (has, word) in enumerate(written)).all(),
                cover=written[0][0], lemma=True)


def _of(words: list[Bits], place: Bits, at: int, size: int) -> Bits:
    """Return a word of a block in memory."""
    return Array(words[at::size])[place]


class _Places:
    """What the memory of the plan has for each place.

    Attributes
    ----------
    gain, limit, entry : list of Value
        Of each place; an entry that is half written has its high word from the adder.
    """

    def __init__(self, c: Contract, dut: BlockQueue) -> None:
        words = c.words("plan")
        head, left, phase = c.signal("head"), c.signal("left"), c.signal("phase")
        self.current = (head + left)[:len(head)]
        self.halfway = c.signal("active") & (phase[:3] == 0) & (left >= 0)
        self.gain, self.limit, self.entry, self.high = [], [], [], []
        for place in range(dut.depth):
            low = 8 * place
            self.gain.append(Cat(words[low:low + 2]))
            self.limit.append(Cat(words[low + 2:low + 4]))
            half = self.halfway & (self.current == place)
            self.entry.append(Cat(words[low + 4], Mux(half, c.signal("back"), words[low + 5])))
            self.high.append(words[low + 5])


def _arithmetic(c: Contract, dut: BlockQueue, places: _Places) -> None:
    """State what is in the adder's registers in each clock of a block."""
    adding, active = c.signal("adding"), c.signal("active")
    phase = c.signal("phase")
    clock, current = phase[:3], places.current
    front, back = c.signal("front"), c.signal("back")
    carry, over, same = c.signal("carry"), c.signal("over"), c.signal("same")
    read = [c.part("plan").read_ports[0].data, *(c.signal(f"read_{age}") for age in range(3))]
    w = dut.word
    behind = (current + 1)[:len(current)]
    after = Mux(adding, 0, Array(places.entry)[behind])[:2 * w]
    gain, limit = Array(places.gain)[current], Array(places.limit)[current]
    entry = Array(places.entry)[current]
    total = (after + gain)[:2 * w + 1]
    new = Mux(total < limit, total, limit)[:2 * w]
    low, high = slice(0, w), slice(w, 2 * w)
    passes = total[:2 * w] >= limit
    whole = [gain[low], gain[high], limit[low], limit[high], entry[low], entry[high]]
    states = {
        1: (front == after[high]) & (back == after[low]),
        2: (front == after[low]) & (back == after[high]),
        3: (front == after[high]) & (back == total[low])
        & (carry == (after[low] + gain[low])[w]),
        4: (front == total[low]) & (back == total[high]) & (carry == total[2 * w]),
        5: (front == total[high]) & (back == total[low]) & (over == total[2 * w])
        & (carry == (total[low] >= limit[low])),
        6: (front == total[low]) & (back == total[high]) & (over == total[2 * w])
        & (carry == passes),
        7: (front == total[high]) & (back == new[low]) & (over == total[2 * w])
        & (carry == passes) & (same == (new[low] == entry[low])),
        0: (front == new[low]) & (back == new[high])
        & ((c.signal("left") < 0) | (entry[low] == new[low]))
        & (~same | (Array(places.high)[current] == new[high])),
    }
    for at, state in states.items():
        # Words are read two clocks before they are used, limits four; entries change in 7.
        for age, word in enumerate(read):
            number = at - 1 - age
            if at and 0 <= number < 6 and not (at == 7 and number == 4):
                state = state & (word == whole[number])
        c.implication(f"clock-{at}", "The registers have what the schedule says.",
                      when=active & (clock == at), then=state, lemma=True)


def _entries(c: Contract, dut: BlockQueue, places: _Places) -> None:
    """State the plan, for every place."""
    head, left, count = c.signal("head"), c.signal("left"), dut.count
    adding, active, same = c.signal("adding"), c.signal("active"), c.signal("same")
    clock = c.signal("phase")[:3]
    planned, possible, pending, sound = [], [], [], []
    for place in range(dut.depth):
        position = (place - head)[:len(head)]
        queued = position < count
        after = Mux(position + 1 == count, 0, places.entry[(place + 1) % dut.depth])
        total = after + places.gain[place]
        entry, limit = places.entry[place], places.limit[place]
        least = Mux(total < limit, total, limit)
        behind = (position - left)[:len(head)]
        is_next = active & ~adding & Mux(
            clock == 0, (behind == dut.depth - 1) & (left > 0) & ~same, (behind == 0) & (left >= 0))
        planned.append(~queued | (entry == least))
        pending.append(~queued | is_next | (entry == least))
        possible.append(~queued | (entry <= limit) & (entry <= total))
        sound.append(limit >> dut.width == 0)
    c.implication("planned", "Once a pass is over, every entry is the lower of its limit and of "
                  "the entry after it plus its gain.", when=~active & ~adding,
                  then=Cat(planned).all())
    c.invariant("possible", "At no time is an entry above its limit, or above the entry after it "
                "plus its gain.", Cat(possible).all(), cover=active & ~adding)
    c.invariant("one-pending", "Only the next block of a pass may have another entry: where one "
                "stays as it was, those before it do.", Cat(pending).all(),
                cover=active & ~adding, lemma=True)
    c.invariant("limits", "A limit has no more bits than w.", Cat(sound).all(), cover=count != 0,
                lemma=True)


def _exits(c: Contract, dut: BlockQueue, places: _Places) -> None:
    """State that exits are entries, and when."""
    head, taken, valid = c.signal("head"), c.signal("taken"), c.signal("valid")
    phase, count = c.signal("phase"), dut.count
    data = c.part("plan").read_ports[0].data
    number = [c.signal("read_0"), c.signal("read_1")]
    changes = taken | dut.flush | c.rst
    c.implication("exit-of-the-taken", "A block that is taken brings its exit along, and that of "
                  "the next one begins at 0.", when=c.past(taken & ~dut.flush & ~c.rst),
                  then=(dut.exit == c.past(dut.next_exit)) & (dut.next_exit == 0))
    for second, name, exit in ((0, "exit", dut.exit), (1, "next-exit", dut.next_exit)):
        place = (head + second)[:len(head)]
        there = count > second
        entry = Mux(there, Array(places.entry)[place], 0)
        c.invariant(f"{name}-possible", "It is never above the entry of the block after it; 0 if "
                    "there is none.", exit <= entry, cover=there)
        c.implication(f"{name}-never-falls", "It does not fall while it is of the same block.",
                      when=~c.past(changes) & c.past(1), then=exit >= c.past(exit))
        stable = c.keep(range(FOLLOWS + 1), name=f"stable_{second}")
        is_stable = ~c.past(changes) & (entry == c.past(entry)) & c.past(1)
        clocks = Mux(is_stable, stable, 0)  # in which the entry was as it is
        c.m.d.sync += stable.eq(Mux(clocks == FOLLOWS, FOLLOWS, clocks + 1))
        c.implication(f"{name}-follows", "It is the entry of the block after it, 20 clocks after "
                      "that has changed.", when=clocks == FOLLOWS, then=exit == entry)
        since = (phase - 2 - 8 * second)[:4]  # clocks since it was refreshed
        c.implication(f"{name}-refreshed", "It is the entry since it was refreshed.",
                      when=clocks > since + 3, then=exit == entry, lemma=True)
        high = Array(places.high)[place]
        for at, found in ((7, Cat(data, high)), (8, Cat(number[0], data)),
                          (9, Cat(number[1], number[0]))):
            now = phase == (at + 8 - 8 * second) % 16
            c.implication(f"{name}-read-{at}", "What is read is between the exit and the entry.",
                          when=now & valid,
                          then=there & (exit <= found) & (found <= entry)
                          & ((clocks <= at - 7) | (found == entry)), lemma=True)
            c.implication(f"{name}-is-read-{at}", "It is read if there was a block.",
                          when=now & there & (clocks > at - 7), then=valid | (exit == entry),
                          lemma=True)


PLAN = Component(
    make=BlockQueue, describe=describe, depth=43,
    cases=(Case({"depth": 4, "words": 4, "word": 2, "width": 3}),
           Case({"depth": 64, "words": 16, "word": 36, "width": 62}, real=True)))
