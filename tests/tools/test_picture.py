"""From a picture to pixels, against rules that hold for every picture."""

import io
import os
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from PIL import Image

from tools.picture import (
    MM_PER_PIXEL,
    PictureError,
    encode,
    load,
    prepare,
    preview,
)
from tools.raster import thinned

SHAPES = arrays.array_shapes(min_dims=2, max_dims=2, max_side=12)
BITS = arrays.arrays(bool, SHAPES)
GREYS = arrays.arrays(np.uint8, SHAPES)


def picture(pixels: np.ndarray, dark: int = 0, light: int = 255) -> Image.Image:
    return Image.fromarray(np.where(pixels, dark, light).astype(np.uint8))


def drawn(text: str) -> np.ndarray:
    return np.array([[mark == "#" for mark in line] for line in text.split()])


class TestLoad:
    @pytest.fixture
    def path(self, tmp_path):
        return tmp_path / "picture.png"

    @pytest.mark.parametrize("mode", ["RGBA", "LA"])
    def test_white_on_transparent_is_a_drawing(self, mode, path):
        """What is opaque is milled, and no more: over white it would be white all over."""
        pixels = drawn("..... .###. .#... .....")
        white = Image.new("L", pixels.shape[::-1], 255)
        image = Image.merge("LA", [white, Image.fromarray((pixels * 255).astype(np.uint8))])
        image.convert(mode).save(path)
        assert (prepare(load(path)).pixels == pixels).all()

    @pytest.mark.parametrize("ink", [0, 128, 254])
    def test_any_other_ink_on_transparent_is_milled_too(self, ink, path):
        pixels = drawn("..... .###. .#... .....")
        grey = Image.new("L", pixels.shape[::-1], ink)
        Image.merge("LA", [grey, Image.fromarray((pixels * 255).astype(np.uint8))]).save(path)
        assert (prepare(load(path)).pixels == pixels).all()

    # Black, white and a middle grey, as every mode holds them.
    @pytest.mark.parametrize(
        ("mode", "suffix"),
        [*((mode, "png") for mode in ("L", "RGB", "RGBA", "LA", "P")),
         *((mode, "tiff") for mode in ("L", "RGB", "RGBA", "P", "CMYK"))],
    )  # fmt: skip
    def test_modes(self, mode, suffix, tmp_path):
        grey = Image.fromarray(np.array([[0, 128, 255]], np.uint8))
        path = tmp_path / f"picture.{suffix}"
        (grey.convert("RGB") if mode == "CMYK" else grey).convert(mode).save(path)
        read = load(path)
        assert read.mode == "L"
        assert np.abs(np.asarray(read).astype(int) - [[0, 128, 255]]).max() <= 1

    def test_one_bit(self, path):
        Image.fromarray(np.array([[True, False]])).save(path)
        assert np.asarray(load(path)).tolist() == [[255, 0]]

    def test_sixteen_bits(self, path):
        Image.fromarray(np.array([[0, 0x80FF, 0xFFFF]], np.uint16)).save(path)
        assert np.asarray(load(path)).tolist() == [[0, 0x80, 0xFF]]

    def test_thirty_two_bits(self, tmp_path):
        path = tmp_path / "picture.tiff"
        Image.fromarray(np.array([[0, 0x80FF, 0xFFFF]], np.int32)).save(path)
        assert np.asarray(load(path)).tolist() == [[0, 0x80, 0xFF]]

    def test_real_numbers(self, tmp_path):
        path = tmp_path / "picture.tiff"
        Image.fromarray(np.array([[-1, 0, 1, np.nan]], np.float32)).save(path)
        assert np.asarray(load(path)).tolist() == [[0, 128, 255, 255]]

    @pytest.mark.parametrize("mode", ["RGBA", "LA"])
    def test_transparent_is_white(self, mode, path):
        image = Image.new("RGBA", (2, 1), (0, 0, 0, 0))
        image.putpixel((1, 0), (0, 0, 0, 255))
        image.convert(mode).save(path)
        assert np.asarray(load(path)).tolist() == [[255, 0]]

    def test_transparent_colour_of_a_palette(self, path):
        image = Image.new("P", (2, 1), 0)
        image.putpalette([0, 0, 0, 0, 0, 0])
        image.putpixel((1, 0), 1)
        image.save(path, transparency=0)
        assert np.asarray(load(path)).tolist() == [[255, 0]]

    def test_transparent_grey(self, path):
        Image.fromarray(np.array([[9, 0]], np.uint8)).save(path, transparency=9)
        assert np.asarray(load(path)).tolist() == [[255, 0]]

    def test_first_of_an_animation(self, tmp_path):
        path = tmp_path / "picture.gif"
        first, second = Image.new("L", (3, 2), 0), Image.new("L", (3, 2), 255)
        first.save(path, save_all=True, append_images=[second])
        assert not np.asarray(load(path)).any()

    # What the camera says of its first row and column, and where the picture's corner 7 is then.
    @pytest.mark.parametrize(
        ("orientation", "upright"),
        [(1, [[7, 0, 0], [0, 0, 0]]), (3, [[0, 0, 0], [0, 0, 7]]),
         (6, [[0, 7], [0, 0], [0, 0]]), (8, [[0, 0], [0, 0], [7, 0]])],
    )  # fmt: skip
    def test_orientation_of_the_camera(self, orientation, upright, path):
        exif = Image.Exif()
        exif[0x0112] = orientation
        Image.fromarray(np.array([[7, 0, 0], [0, 0, 0]], np.uint8)).save(path, exif=exif)
        assert np.asarray(load(path)).tolist() == upright

    def test_missing(self, path):
        with pytest.raises(PictureError, match=r"^there is no file .*: check its name$"):
            load(path)

    def test_folder(self, tmp_path):
        with pytest.raises(PictureError, match=r" is a folder: name a picture in it$"):
            load(tmp_path)

    def test_file_for_a_folder(self, path):
        path.write_text("")
        with pytest.raises(PictureError, match=r"^cannot read .*x\.png: Not a directory$"):
            load(path / "x.png")

    def test_pipe(self, path):
        os.mkfifo(path)
        with pytest.raises(PictureError, match=r" is not a file: save the picture to one first$"):
            load(path)

    def test_empty(self, path):
        path.write_bytes(b"")
        with pytest.raises(PictureError, match=r" is empty: save the picture again$"):
            load(path)

    def test_not_a_picture(self, path):
        path.write_bytes(b"a letter, not a picture")
        with pytest.raises(PictureError, match=r" is not a picture, or of a kind not read here"):
            load(path)

    def test_kind_that_is_a_program(self, path):
        Image.new("L", (2, 2)).save(path, "EPS")
        with pytest.raises(PictureError, match=r" is not a picture, or of a kind not read here"):
            load(path)

    @pytest.mark.parametrize("kind", ["PNG", "JPEG", "GIF", "BMP", "TIFF", "WEBP", "PPM"])
    def test_cut_short_anywhere(self, kind, path):
        noise = np.random.default_rng(1).integers(0, 256, (40, 40), np.uint8)
        buffer = io.BytesIO()
        Image.fromarray(noise).convert("RGB").save(buffer, kind)
        data = buffer.getvalue()
        for length in range(1, len(data) // 2, 13):
            path.write_bytes(data[:length])
            with pytest.raises(PictureError, match=r"is damaged|is not a picture"):
                load(path)

    @given(place=st.integers(0, 10**6), value=st.integers(0, 255))
    def test_damaged_is_read_or_refused(self, place, value, tmp_path_factory):
        data = bytearray(encode(Image.fromarray(np.eye(20, dtype=bool))))
        data[place % len(data)] = value
        path = tmp_path_factory.getbasetemp() / "damaged.png"
        path.write_bytes(data)
        try:
            assert load(path).mode == "L"
        except PictureError as error:
            assert "\n" not in str(error)

    # Below Pillow's own limit, above its warning, above its error.
    @pytest.mark.parametrize("side", [8001, 10_000, 20_000])
    def test_huge(self, side, path):
        def chunk(kind: bytes, body: bytes) -> bytes:
            check = struct.pack(">I", zlib.crc32(kind + body))
            return struct.pack(">I", len(body)) + kind + body + check

        header = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
        rows = zlib.compress(bytes((side // 8 + 2) * side))
        chunks = chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)
        with pytest.raises(PictureError, match=r" is larger than 64 megapixels: make it smaller"):
            load(path)

    def test_no_pixels(self, path):
        path.write_bytes(b"P5 0 0 255\n")
        with pytest.raises(PictureError):
            load(path)


class TestPrepare:
    @pytest.mark.parametrize(
        ("mode", "dark", "light"),
        [("1", 0, 1), ("L", 99, 101), ("RGB", (99, 99, 99), (101, 101, 101)), ("F", -1.0, 1.0),
         ("YCbCr", (99, 128, 128), (101, 128, 128)), ("HSV", (0, 0, 99), (0, 0, 101)),
         ("LAB", (99, 0, 0), (101, 0, 0)), ("I", 99 * 257, 101 * 257),
         ("I;16", 99 * 257, 101 * 257), ("RGBA", (0, 0, 0, 156), (0, 0, 0, 154))],
    )  # fmt: skip
    def test_modes(self, mode, dark, light):
        image = Image.new(mode, (2, 1), light)
        image.putpixel((1, 0), dark)
        assert prepare(image, threshold=100).pixels.tolist() == [[False, True]]

    @given(BITS.filter(np.any), st.integers(0, 254), st.data())
    def test_two_values_come_through_exactly(self, pixels, dark, data):
        light = data.draw(st.integers(dark + 1, 255))
        threshold = data.draw(st.one_of(st.integers(dark, light - 1), st.none()))
        if pixels.all() and threshold is None:
            dark = min(dark, 127)
        got = prepare(picture(pixels, dark, light), threshold=threshold)
        assert (got.pixels == pixels).all()
        assert (got.scale, got.count) == (1, pixels.sum())

    @given(pixels=BITS.filter(np.any))
    def test_its_own_output_comes_through_exactly(self, pixels, tmp_path_factory):
        path = tmp_path_factory.getbasetemp() / "own.png"
        path.write_bytes(encode(Image.fromarray(~pixels)))
        assert (prepare(load(path)).pixels == pixels).all()

    @pytest.mark.parametrize("shape", [(400, 400), (1, 400), (400, 1), (512, 512)])
    def test_the_largest_is_not_scaled(self, shape):
        pixels = np.random.default_rng(1).random(shape) < 0.5
        side = max(shape)
        assert (prepare(picture(pixels), width=side, height=side).pixels == pixels).all()

    @given(GREYS, st.integers(0, 255))
    def test_inverse_is_the_rest(self, grey, threshold):
        image = Image.fromarray(grey)
        dark = grey <= threshold
        if dark.any():
            assert (prepare(image, threshold=threshold).pixels == dark).all()
        if not dark.all():
            assert (prepare(image, threshold=threshold, invert=True).pixels == ~dark).all()

    @given(GREYS, st.integers(0, 255), st.integers(0, 255))
    def test_higher_threshold_mills_no_less(self, grey, one, other):
        low, high = sorted((one, other))
        grey[0, 0] = 0
        image = Image.fromarray(grey)
        less, more = (prepare(image, threshold=level).pixels for level in (low, high))
        assert (less <= more).all()

    @given(BITS.filter(np.any))
    def test_turns_and_mirrors(self, pixels):
        def again(pixels, **options):
            return prepare(picture(pixels), threshold=0, **options).pixels

        quarter = again(pixels, turn=90)
        # Clockwise: the first column, read upwards, is the first row.
        assert (quarter[0] == pixels[::-1, 0]).all()
        assert (again(quarter, turn=90) == again(pixels, turn=180)).all()
        assert (again(quarter, turn=180) == again(pixels, turn=270)).all()
        assert (again(quarter, turn=270) == pixels).all()
        across, down = (again(pixels, mirror=way) for way in ("horizontal", "vertical"))
        assert (across[:, 0] == pixels[:, -1]).all()
        assert (down[0] == pixels[-1]).all()
        assert (again(across, mirror="horizontal") == pixels).all()
        assert (again(across, mirror="vertical") == again(pixels, turn=180)).all()
        # Turned first, then mirrored.
        both = again(pixels, turn=90, mirror="vertical")
        assert (both == again(quarter, mirror="vertical")).all()

    @given(
        st.tuples(st.integers(1, 60), st.integers(1, 60)),
        st.tuples(st.integers(1, 40), st.integers(1, 40)),
        st.booleans(),
        st.booleans(),
    )
    def test_fits_and_keeps_proportions(self, source, most, enlarge, keep_lines):
        image = Image.new("L", source, 0)
        got = prepare(image, width=most[0], height=most[1], enlarge=enlarge, keep_lines=keep_lines)
        assert got.width <= most[0] and got.height <= most[1]
        assert got.source == source
        for side, original in zip((got.width, got.height), source, strict=True):
            assert side == 1 or abs(side - original * got.scale) <= 0.5
        if source[0] <= most[0] and source[1] <= most[1]:
            assert got.scale >= 1 if enlarge else got.scale == 1
        else:
            assert got.scale < 1
            assert got.width == most[0] or got.height == most[1]

    def test_enlarged_pixels_stay_square(self):
        pixels = drawn("#.. .#. ###")
        got = prepare(picture(pixels), width=14, height=100, enlarge=True)
        assert (got.pixels == np.kron(pixels, np.ones((4, 4), bool))).all()
        assert got.scale == 4

    def test_enlarged_photograph_fits(self):
        got = prepare(Image.linear_gradient("L"), width=300, height=400, enlarge=True)
        assert (got.width, got.height) == (300, 300)

    @pytest.mark.parametrize("invert", [False, True])
    def test_keep_lines(self, invert):
        # A block and a hair: blended, the hair is too pale beside the block.
        pixels = np.zeros((100, 100), bool)
        pixels[10:50, 10:50] = True
        pixels[80] = True
        image = picture(pixels != invert)
        lost = prepare(image, width=10, height=10, threshold=127, invert=invert)
        kept = prepare(image, width=10, height=10, threshold=127, invert=invert, keep_lines=True)
        assert not lost.pixels[8].any()
        assert kept.pixels[8].all()
        assert kept.count == 10 + 16

    @given(arrays.arrays(bool, (23, 17)).filter(np.any))
    def test_keep_lines_loses_no_figure(self, pixels):
        got = prepare(picture(pixels), width=5, height=7, threshold=0, keep_lines=True).pixels
        assert got.shape == (7, 5)
        rows, columns = (np.arange(n) * m // n for n, m in ((7, 23), (5, 17)))
        for row, column in np.argwhere(pixels):
            assert got[(rows <= row).sum() - 1, (columns <= column).sum() - 1]

    def test_outline_and_thin(self):
        pixels = drawn("##### ##### #####")
        edge = prepare(picture(pixels), threshold=0, outline=True).pixels
        assert (edge == drawn("##### #...# #####")).all()
        line = prepare(picture(pixels), threshold=0, thin=True).pixels
        assert (line == thinned(pixels)).all()

    @pytest.mark.parametrize(
        ("greys", "options", "message"),
        [
            ([255, 255], {}, "the picture is one grey all over"),
            ([0, 0], {"invert": True}, "the picture is one grey all over"),
            ([100, 120], {"threshold": 99},
             "no pixel is as dark as the threshold 99; try another --threshold"),
            ([80, 100], {"threshold": 100, "invert": True},
             "no pixel is lighter than the threshold 100; try another --threshold"),
        ],
    )
    def test_nothing_to_mill(self, greys, options, message):
        with pytest.raises(PictureError, match=f"^nothing to mill: {message}$"):
            prepare(Image.fromarray(np.array([greys], np.uint8)), **options)

    def test_no_pixels(self):
        with pytest.raises(PictureError, match=r"^the picture has no pixels: choose another$"):
            prepare(Image.new("L", (0, 3)))

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"width": 0}, "^Width and height must be 1 to 512 pixels, not 0$"),
            ({"height": 513}, "^Width and height must be 1 to 512 pixels, not 513$"),
            ({"threshold": 256}, "^Threshold must be 0 to 255, not 256$"),
            ({"threshold": -1}, "^Threshold must be 0 to 255, not -1$"),
            ({"turn": 45}, "^Turn must be 0, 90, 180 or 270 degrees, not 45$"),
            ({"mirror": "up"}, "^Mirror must be None, 'horizontal' or 'vertical', not 'up'$"),
            ({"outline": True, "thin": True}, "^Outline and thin exclude each other$"),
        ],
    )
    def test_parameters(self, options, message):
        with pytest.raises(ValueError, match=message):
            prepare(Image.new("L", (1, 1)), **options)

    def test_facts(self):
        got = prepare(picture(drawn("##.. ....")))
        assert got.facts() == {
            "width": 4,
            "height": 2,
            "width_mm": 2.222,
            "height_mm": 1.111,
            "pixels": 2,
            "share": 0.25,
            "threshold": 127,
            "automatic_threshold": True,
            "scale": 1.0,
            "source_width": 4,
            "source_height": 2,
        }
        assert got.summary() == (
            "4 x 2 pixels, 2.2 x 1.1 mm, 2 to mill (25.0%), threshold 127 (found), scale 1"
        )

    def test_pixels_cannot_be_changed(self):
        with pytest.raises(ValueError, match="read-only"):
            prepare(Image.new("L", (1, 1))).pixels[0, 0] = False


class TestPreview:
    def test_dark_where_milled(self):
        pixels = drawn("#.. .## ..#")
        image = preview(pixels, 10).convert("L")
        got = np.asarray(image)[24 : 24 + 30, 24 : 24 + 30]
        assert ((got < 80) == np.kron(pixels, np.ones((10, 10), bool))).all()
        assert (got[~np.kron(pixels, np.ones((10, 10), bool))] > 200).all()

    @pytest.mark.parametrize(("side", "scale", "bar"), [(64, 12, 10), (48, 16, 5), (400, 2, 50)])
    def test_bar_has_its_length(self, side, scale, bar):
        image = np.asarray(preview(np.zeros((side, side), bool)).convert("L"))
        row = image[2 * 24 + side * scale + 6]
        dark = np.flatnonzero(row < 80)
        end = np.flatnonzero(np.diff(dark) > 1)[0]
        length = dark[end] - dark[0]
        assert length == pytest.approx(bar / MM_PER_PIXEL * scale, abs=3)

    @pytest.mark.parametrize("shape", [(1, 1), (1, 512), (512, 1), (512, 512)])
    def test_any_size(self, shape):
        image = preview(np.ones(shape, bool))
        assert max(image.size) < 1300

    def test_scale(self):
        with pytest.raises(ValueError, match=r"^Scale must be at least 1, not 0$"):
            preview(np.ones((1, 1), bool), 0)
