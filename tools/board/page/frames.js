/**
 * Decoder of frames, sent up to thirty times a second: two bytes, version and mask, then
 * a part for each bit of the mask, little endian.
 */

const VERSION = 1;

/** Reads numbers in order. */
class Reader {
  constructor(buffer) {
    this.view = new DataView(buffer);
    this.at = 0;
  }

  take(size) {
    const at = this.at;
    this.at += size;
    return at;
  }

  u8() { return this.view.getUint8(this.take(1)); }
  i32() { return this.view.getInt32(this.take(4), true); }
  u32() { return this.view.getUint32(this.take(4), true); }
  f32() { return this.view.getFloat32(this.take(4), true); }
  f64() { return this.view.getFloat64(this.take(8), true); }
  bytes(count) { return new Uint8Array(this.view.buffer, this.take(count), count); }

  /** Items of a growing list: index of the first, number of items, items. */
  list(item) {
    const first = this.u32();
    const count = this.u32();
    return { first, items: Array.from({ length: count }, item) };
  }
}

const PARTS = [
  ["time", (r) => ({ clock: r.f64(), rate: r.f32() })],
  ["inputs", (r) => ({ switches: r.u8(), buttons: r.u8() })],
  ["leds", (r) => r.bytes(8)],
  ["display", (r) => r.bytes(32)],
  ["motors", (r) => Array.from({ length: 3 }, () => ({ word: r.u8(), position: r.i32() }))],
  ["path", (r) => r.list(() => ({ x: r.i32(), y: r.i32(), cut: (r.u8() & 1) === 1 }))],
  ["cut", (r) => r.list(() => r.u32())],
];

/**
 * Decode a frame into its parts.
 * @param {ArrayBuffer} buffer
 * @returns {{time?: object, inputs?: object, leds?: Uint8Array, display?: Uint8Array,
 *   motors?: object[], path?: {first: number, items: object[]},
 *   cut?: {first: number, items: number[]}}}
 * @throws {RangeError} if its version differs, or it is truncated
 */
export function decode(buffer) {
  const reader = new Reader(buffer);
  if (reader.u8() !== VERSION) throw new RangeError("a frame of another version");
  const mask = reader.u8();
  const frame = {};
  PARTS.forEach(([name, read], bit) => {
    if (mask & (1 << bit)) frame[name] = read(reader);
  });
  return frame;
}
