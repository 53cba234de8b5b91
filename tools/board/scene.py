"""The state of the machine that pages show, and frames of its changes.

A frame is little endian: version 1, a mask, then the parts whose bits are set. Parts of fixed size
are sent when they differ from those that the page has. The path and the cut pixels are growing
lists: the page gets the next items, some thousands a frame.
"""

import struct

from .messages import CORNER, PIXEL, Snapshot

__all__ = ["Scene", "SceneView", "unpack"]

VERSION = 1

#: Parts of fixed size, in the order of their bits, and their bytes.
PARTS = {"time": 12, "inputs": 2, "leds": 8, "display": 32, "motors": 15}

#: Parts that are lists, which follow, and the bytes of an item.
LISTS = {"path": CORNER.itemsize, "cut": PIXEL.itemsize}

#: Most items of a list in a frame.
CHUNK = 4096


class _List:
    """Items of a list that grows, or starts again as another generation."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.items = bytearray()
        self.generation = 0

    def __len__(self) -> int:
        return len(self.items) // self.size

    def add(self, items: bytes, *, anew: bool) -> None:
        if anew:
            self.items = bytearray()
            self.generation += 1
        self.items += items


class Scene:
    """The newest state of the machine."""

    def __init__(self) -> None:
        self.fixed: dict[str, bytes] = {"inputs": bytes(2)}
        self.path, self.cut = _List(LISTS["path"]), _List(LISTS["cut"])
        self.tip = b""

    def apply(self, snapshot: Snapshot) -> None:
        """Apply a snapshot of the simulation."""
        self.fixed |= {name: getattr(snapshot, name)
                       for name in ("time", "leds", "display", "motors")}
        self.path.add(snapshot.path, anew=snapshot.path_anew)
        self.cut.add(snapshot.cut, anew=snapshot.cut_anew)
        self.tip = snapshot.tip

    def touch(self, switches: int, buttons: int) -> None:
        """Show the contacts as pages set them."""
        self.fixed["inputs"] = bytes((switches, buttons))


class SceneView:
    """The part of a scene that one page has been sent."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._got: dict[str, bytes] = {}
        self._path = self._cut = (0, 0)  # generation, items
        self._tip = b""

    def frame(self) -> bytes | None:
        """Return changes that the page has not been sent, and mark them as sent; None if none."""
        scene, mask, parts = self._scene, 0, []
        if "time" not in scene.fixed:
            return None
        for bit, name in enumerate(PARTS):
            if self._got.get(name) != scene.fixed[name]:
                mask |= 1 << bit
                parts.append(scene.fixed[name])
        self._got = dict(scene.fixed)
        for bit, part in enumerate((self._take_path(), self._take_cut()), len(PARTS)):
            if part is not None:
                mask |= 1 << bit
                parts.append(part)
        return bytes([VERSION, mask]) + b"".join(parts) if mask else None

    def _take_path(self) -> bytes | None:
        path = self._scene.path
        first, items, self._path, anew = _take(path, self._path)
        whole = self._path[1] == len(path)
        if whole and (items or anew or self._tip != self._scene.tip):
            self._tip = self._scene.tip
            items += self._tip
        return _part(first, items, path.size) if items or anew else None

    def _take_cut(self) -> bytes | None:
        first, items, self._cut, anew = _take(self._scene.cut, self._cut)
        return _part(first, items, self._scene.cut.size) if items or anew else None


def unpack(frame: bytes) -> dict[str, bytes | tuple[int, bytes]]:
    """Decode a frame, as pages do.

    Returns
    -------
    dict of str to bytes or pair
        Parts by name; of a list the index of its first item, and its items.

    Raises
    ------
    ValueError
        If it is not a frame.
    """
    if len(frame) < 2 or frame[0] != VERSION or frame[1] >> len(PARTS | LISTS):
        raise ValueError("Frame must begin with its version and a mask of parts")
    parts: dict[str, bytes | tuple[int, bytes]] = {}
    at = 2
    for bit, (name, size) in enumerate((PARTS | LISTS).items()):
        if frame[1] >> bit & 1 == 0:
            continue
        if name in PARTS:
            parts[name] = frame[at:at + size]
            at += size
        else:
            if at + 8 > len(frame):
                raise ValueError("Frame must be complete")
            first, items = struct.unpack_from("<II", frame, at)
            parts[name] = first, frame[at + 8:at + 8 + items * size]
            at += 8 + items * size
    if at != len(frame):
        raise ValueError(f"Frame must have {at} bytes, not {len(frame)}")
    return parts


def _take(grows: _List, got: tuple[int, int]) -> tuple[int, bytes, tuple[int, int], bool]:
    """Return index and items of the next part of a list, the state after it, and if that is all."""
    generation, first = got
    if anew := generation != grows.generation:
        first = 0
    last = min(len(grows), first + CHUNK)
    items = bytes(grows.items[first * grows.size:last * grows.size])
    return first, items, (grows.generation, last), anew


def _part(first: int, items: bytes, size: int) -> bytes:
    return struct.pack("<II", first, len(items) // size) + items
