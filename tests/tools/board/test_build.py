"""Machines made in a thread, and the slow engine where the fast one fails."""

import time

import numpy as np

from tb.engines import AmaranthEngine, CXXRTLEngine, EngineError
from tools.board import build
from tools.board.build import Builder
from tools.board.messages import Job

JOB = Job(np.array([[1]], bool), "dot")


def make(builder: Builder, number: int) -> tuple:
    builder.request(number, JOB)
    end = time.monotonic() + 60
    while (built := builder.built()) is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    return built


def test_the_slow_engine_serves_and_that_is_told_for_as_long_as_it_is_so(monkeypatch):
    ready, broken = build._ready, True

    def breaks(job, kind):
        if kind is CXXRTLEngine and broken:
            raise EngineError("The compiler failed")
        return ready(job, AmaranthEngine)

    monkeypatch.setattr("tb.engines.choose", lambda name: CXXRTLEngine)
    monkeypatch.setattr(build, "_ready", breaks)
    builder = Builder(None)
    number, job, _, engine = make(builder, 1)
    assert (number, job.period) == (1, build.timing_of(AmaranthEngine)[0])
    assert isinstance(engine, AmaranthEngine)
    assert builder.note == ("The compiler failed; using the slow engine, amaranth, "
                            "which takes hundreds of times as long")
    engine.close()
    broken = False
    make(builder, 2)[3].close()
    assert builder.note is None


def test_an_engine_that_was_asked_for_is_not_replaced(monkeypatch):
    def breaks(job, kind):
        raise EngineError("The compiler failed")

    monkeypatch.setattr("tb.engines.choose", lambda name: CXXRTLEngine)
    monkeypatch.setattr(build, "_ready", breaks)
    builder = Builder("cxxrtl")
    assert str(make(builder, 1)[3]) == "The compiler failed"
    assert builder.note is None
