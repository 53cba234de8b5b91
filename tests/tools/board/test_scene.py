"""Frames: what a page puts together from them is what there is, whenever it takes one."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tools.board import scene as scenes
from tools.board.messages import CORNER, PIXEL, Snapshot
from tools.board.scene import PARTS, Scene, SceneView, unpack


def snapshot(path=b"", cut=b"", *, anew=(False, False), tip=(0, 0, 0), fill=0) -> Snapshot:
    fixed = {name: bytes([fill]) * PARTS[name] for name in ("time", "leds", "display", "motors")}
    return Snapshot(**fixed, path=path, tip=np.array([tip], CORNER).tobytes(), path_anew=anew[0],
                    cut=cut, cut_anew=anew[1])


def corners(*places) -> bytes:
    return np.array(list(places), CORNER).tobytes()


def pixels(*numbers) -> bytes:
    return np.array(numbers, PIXEL).tobytes()


class Page:
    """What a page keeps: parts, and lists that are cut where a frame goes on."""

    def __init__(self, scene: Scene) -> None:
        self.view = SceneView(scene)
        self.fixed: dict[str, bytes] = {}
        self.lists = {"path": b"", "cut": b""}

    def take(self) -> bool:
        frame = self.view.frame()
        if frame is None:
            return False
        for name, part in unpack(frame).items():
            if isinstance(part, bytes):
                assert self.fixed.get(name) != part
                self.fixed[name] = part
            else:
                first, items = part
                size = scenes.LISTS[name]
                assert first * size <= len(self.lists[name])
                assert len(items) <= (scenes.CHUNK + 1) * size
                self.lists[name] = self.lists[name][:first * size] + items
        return True

    def take_all(self) -> None:
        while self.take():
            pass


events = st.lists(st.one_of(
    st.tuples(st.just("snapshot"), st.integers(0, 9), st.integers(0, 9), st.integers(0, 99),
              st.tuples(*[st.sampled_from([False] * 4 + [True])] * 2)),
    st.tuples(st.just("page"), st.integers(0, 1)),
    st.tuples(st.just("touch"), st.integers(0, 255)),
), max_size=40)


class TestFrames:
    @settings(deadline=None)
    @given(events)
    def test_pages_agree_with_the_machine(self, happens):
        scene = Scene()
        pages = [Page(scene), Page(scene)]
        scene.apply(snapshot(anew=(True, True)))
        path, cut, tip, n = b"", b"", corners((0, 0, 0)), 0
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(scenes, "CHUNK", 3)
            for what, *how in happens:
                if what == "page":
                    pages[how[0]].take()
                elif what == "touch":
                    scene.touch(how[0], 3)
                else:
                    turns, milled, place, anew = how
                    new = corners(*[(n := n + 1, -n, n & 1) for _ in range(turns)])
                    found = pixels(*[n := n + 1 for _ in range(milled)])
                    tip = corners((place, 0, 1))
                    path = new if anew[0] else path + new
                    cut = found if anew[1] else cut + found
                    scene.apply(snapshot(new, found, anew=anew, tip=(place, 0, 1), fill=n % 256))
            pages.append(Page(scene))
            for page in pages:
                page.take_all()
                assert page.fixed == scene.fixed
                assert page.lists == {"path": path + tip, "cut": cut}

    def test_nothing_is_sent_twice(self):
        scene = Scene()
        page = SceneView(scene)
        assert page.frame() is None  # there is no machine yet
        scene.apply(snapshot(corners((1, 2, 0)), pixels(7), anew=(True, True)))
        assert unpack(page.frame() or b"").keys() == {*PARTS, "path", "cut"}
        assert page.frame() is None
        scene.apply(snapshot())
        assert page.frame() is None
        scene.apply(snapshot(tip=(5, 0, 0)))
        assert unpack(page.frame() or b"") == {"path": (1, corners((5, 0, 0)))}
        scene.touch(1, 2)
        assert unpack(page.frame() or b"") == {"inputs": b"\1\2"}

    def test_an_empty_plate_is_told(self):
        scene = Scene()
        page = Page(scene)
        scene.apply(snapshot(corners((1, 2, 0)), pixels(7), anew=(True, True)))
        page.take_all()
        scene.apply(snapshot(anew=(True, True)))
        page.take_all()
        assert page.lists == {"path": corners((0, 0, 0)), "cut": b""}

    def test_a_page_that_comes_late_gets_all_in_pieces(self):
        scene = Scene()
        count = 3 * scenes.CHUNK + 5
        places = np.zeros(count, CORNER)
        places["x"] = np.arange(count)
        scene.apply(snapshot(places.tobytes(), anew=(True, True)))
        page, frames = Page(scene), 0
        while page.take():
            frames += 1
        assert frames == 4
        assert page.lists["path"] == places.tobytes() + corners((0, 0, 0))


class TestUnpack:
    @pytest.mark.parametrize("frame", [
        b"", b"\1", b"\2\0", b"\1\x80", b"\1\1", b"\1\0x", b"\1\x20" + struct.pack("<II", 0, 1),
    ], ids=repr)
    def test_refuses(self, frame):
        with pytest.raises(ValueError, match="^Frame must "):
            unpack(frame)
