# amaranth: UnusedElaboratable=no

"""Complex movements into simple ones: the longest travel of the tool, which no proof has."""

from fresa.motion import MotionSequencer
from tb.boards import component
from tb.engines import AmaranthEngine

DOWN, UP = 1 << 33, 1 << 32
Z_UP = 1 << 5


def test_longest_travel():
    """Down, not down again, and up: moves by axes, directions and steps."""
    with AmaranthEngine(component("sequencer", MotionSequencer(z_travel=2**15))) as engine:
        moves = []
        for order, at_z in [(DOWN, -(2**15)), (DOWN, -(2**15)), (UP, 0)]:
            engine.set(order=order, start=1)
            engine.run(1)
            engine.set(start=0, moves_ready=1)
            for _ in range(9):
                if engine.get("moves_valid"):
                    moves.append(engine.get("moves_payload"))
                engine.run(1)
            engine.set(at_z=at_z % 65536, moves_ready=0)
            assert engine.get("ready", "error") == (1, 0)
    assert moves == [4 | 2**15 << 6, 4 | Z_UP | 2**15 << 6]
