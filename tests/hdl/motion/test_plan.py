# amaranth: UnusedElaboratable=no

"""The queue of blocks: clock by clock as its model, and planned as by both passes in full."""

import random
from collections import deque

import pytest

from benchmarks.planning import pass_clocks, sustained
from fresa.motion import BlockQueue
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.plan import BlockQueueModel, junctions, plan

SMALL = {"depth": 4, "words": 4, "word": 3, "width": 5}
MIDDLE = {"depth": 8, "words": 8, "word": 6, "width": 11}
BUILT = {"depth": 64, "words": 16, "word": 36, "width": 62}


class Rig:
    """A queue, its model beside it, and the blocks that are in it."""

    def __init__(self, engine, parameters):
        self.engine, self.model = engine, BlockQueueModel(
            **{name: value for name, value in parameters.items() if name != "width"})
        self.queue = BlockQueue(**parameters)
        self.bits = (self.queue.words + 3).bit_length()
        self.clocks = 0

    def clock(self, *, write=None, ready=False, take=False, flush=False, rst=False):
        """Make a clock, and compare every output of it; return the word that went out."""
        seen = {name: self.engine.get(name) for name in self.model.outputs()}
        assert seen == self.model.outputs(), self.clocks
        address, data, last = write or (0, 0, False)
        self.engine.set(
            write_valid=write is not None,
            write_payload=address | data << self.bits | last << self.bits + self.queue.word,
            blocks_ready=ready, take=take, flush=flush, rst=rst)
        word = self.model.offered if ready else None
        self.engine.run(1)
        self.model.edge(write=write, ready=ready, take=take, flush=flush)
        if rst:
            self.model.reset()
        self.clocks += 1
        return word

    def commit(self, words, limit, gain):
        """Write a block as soon as it is accepted; return the clocks until the pass is over."""
        q = self.queue
        numbers = enumerate((gain, limit))
        content = [*enumerate(words),
                   *((q.words + 2 * place + half, number >> half * q.word & (1 << q.word) - 1)
                     for place, number in numbers for half in (0, 1))]
        for address, value in content:
            while not self.model.ready:
                self.clock()
            self.clock(write=(address, value, address == content[-1][0]))
        begun = self.clocks
        while self.model.planning:
            self.clock()
        return self.clocks - begun

    def rest(self):
        """Let the last entries reach the exits."""
        for _ in range(20):
            self.clock()

    def read(self):
        """Read the words of the oldest block."""
        words = []
        while not words or not words[-1][1]:
            word = self.clock(ready=True)
            words += [word] if word else []
        return [word for word, _ in words]


@pytest.fixture
def rig(request):
    with AmaranthEngine(component("queue", BlockQueue(**request.param))) as engine:
        yield Rig(engine, request.param)


@pytest.mark.parametrize("rig", [SMALL, MIDDLE], indirect=True)
@pytest.mark.parametrize("seed", range(2))
def test_is_its_model_in_every_clock(rig, seed):
    rng, q = random.Random(seed), rig.queue
    committed, dropped, out = 0, 0, 0
    content = []
    for _ in range(1500):
        if not content and rng.random() < 0.4:
            gain = rng.getrandbits(2 * q.word) >> rng.choice((1, 2, 4))
            limit = rng.getrandbits(q.width)
            content = [(address, rng.getrandbits(q.word)) for address in range(q.words)]
            content += [(q.gain, gain & (1 << q.word) - 1), (q.gain + 1, gain >> q.word),
                        (q.limit, limit & (1 << q.word) - 1), (q.limit + 1, limit >> q.word)]
            rng.shuffle(content)
        write = None
        if content and rng.random() < 0.9:
            write = (*content[0], len(content) == 1)
        accepted = write is not None and rig.model.ready
        before = rig.model.head
        rig.clock(write=write, ready=rng.random() < 0.6, take=rng.random() < 0.05,
                  flush=rng.random() < 0.003, rst=rng.random() < 0.001)
        out += rig.model.head > before
        if accepted:
            committed += len(content) == 1
            content.pop(0)
            if content and rng.random() < 0.02:  # the line was wrong
                content, dropped = [], dropped + 1
    assert committed > 20
    assert dropped
    assert out > 10


@pytest.mark.parametrize("rig", [SMALL, MIDDLE, BUILT], indirect=True)
def test_blocks_come_out_as_they_went_in_and_exits_are_the_plan(rig):
    rng, q = random.Random(5), rig.queue
    waiting, running = deque(), None
    steps = 80
    for step in range(steps):
        full = len(waiting) == q.depth
        if (not waiting or rng.random() < (0.7 if step < steps * 0.7 else 0.3)) and not full:
            words = [rng.getrandbits(q.word) for _ in range(q.words)]
            limit, gain = rng.getrandbits(q.width), rng.getrandbits(q.width) >> rng.choice((1, 3))
            if rng.random() < 0.1:
                limit = 0
            waiting.append((words, limit, gain))
            rig.commit(*waiting[-1])
        else:
            words, *running = waiting.popleft()
            assert rig.read() == words
            rig.clock(take=True)
        rig.rest()
        entries = plan([(limit, gain) for _, limit, gain in waiting]) + [0, 0]
        if running:
            assert rig.engine.get("exit") == entries[0]
        assert rig.engine.get("next_exit") == entries[1]
    assert running


@pytest.mark.parametrize("rig", [BUILT], indirect=True)
def test_speeds_are_those_of_both_passes(rig):
    rng, q = random.Random(9), rig.queue
    blocks = [(rng.getrandbits(q.width) if number else 0, rng.getrandbits(q.width) >> 3)
              for number in range(12)]
    for number, block in enumerate(blocks):
        rig.commit([number] * q.words, *block)
    w, speeds = 0, [0]
    for number, (_, gain) in enumerate(blocks):
        assert rig.read() == [number] * q.words
        rig.clock(take=True)
        rig.rest()
        w = min(rig.engine.get("exit"), w + gain)
        speeds.append(w)
    assert speeds == junctions(blocks)


@pytest.mark.parametrize("rig", [MIDDLE, BUILT], indirect=True)
def test_a_pass_is_bounded_and_ends_early(rig):
    """Blocks without gain have an entry of 0, until one with a gain is behind them."""
    q = rig.queue
    top = (1 << q.width) - 1
    for _ in range(q.depth - 1):
        assert rig.commit([], top, 0) <= 2 * 8 + 9
    assert 8 * q.depth <= rig.commit([], top, 1) <= min(8 * q.depth + 9, 600)
    rig.rest()
    assert rig.engine.get("next_exit") == 1
    assert rig.engine.get("free") == 0


@pytest.mark.parametrize("rig", [MIDDLE], indirect=True)
def test_an_entry_without_motion_passes_the_speed_through(rig):
    blocks = [(0, 900), (700, 0), (500, 400), (450, 500)]  # the second is a marker
    for number, block in enumerate(blocks):
        rig.commit([number] * 8, *block)
    rig.rest()
    rig.read()
    rig.clock(take=True)
    rig.rest()
    before = rig.engine.get("exit")
    rig.read()
    rig.clock(take=True)  # early: the block before it still runs
    rig.rest()
    assert before == rig.engine.get("exit") == plan(blocks)[2] == 500


@pytest.mark.parametrize("rig", [MIDDLE], indirect=True)
def test_a_flush_drops_all_that_has_not_begun(rig):
    for number in range(3):
        rig.commit([number] * 8, 2000, 100)
    rig.read()
    rig.clock(take=True)
    rig.rest()
    assert rig.engine.get("exit") == 200
    rig.clock(write=(0, 1, True))
    rig.clock(flush=True)  # the one that is committed, too
    for _ in range(40):
        assert (rig.engine.get("count"), rig.engine.get("exit"), rig.engine.get("blocks_valid"),
                rig.engine.get("empty")) == (0, 0, 0, 1)
        rig.clock(ready=True)
    rig.commit([7] * 8, 2000, 100)
    rig.rest()
    assert rig.engine.get("exit") == 100
    assert rig.read() == [7] * 8


@pytest.mark.parametrize(("parameter", "value", "message"), [
    ("depth", 2, "depth must be a whole number from 4 to 256, not 2"),
    ("depth", 48, "depth must be a power of two, not 48"),
    ("words", 12, "words must be a power of two, not 12"),
    ("word", 65, "word must be a whole number from 2 to 64, not 65"),
    ("width", 73, "width must be a whole number from 37 to 72, not 73"),
    ("width", 36, "width must be a whole number from 37 to 72, not 36"),
])
def test_parameters_are_checked(parameter, value, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        BlockQueue(**{parameter: value})


def test_short_segments_go_as_fast_as_the_depth_allows():
    """And no faster than they come."""
    job = {"segment": 0.05, "acceleration": 500, "feed": 1000, "segments": 800,
           "clock": 50_000_000}
    fast, slow = sustained(64, 5000, **job), sustained(64, 500, **job)
    assert fast.by_depth == pytest.approx(3394, abs=1)
    assert fast.speed == pytest.approx(fast.by_depth, rel=0.01)
    assert slow.speed == pytest.approx(slow.by_lines, rel=0.01)
    assert pass_clocks(64) <= 600
