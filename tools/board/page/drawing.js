/** The passive parts of the board, and the shapes of digits. */

import { group, label, svg } from "./svg.js";

/** Corners of the segments a to g of a digit 38 wide and 66 high; the point comes last. */
const SEGMENTS = [
  "4,2 8,-1 30,-1 34,2 30,6 8,6",
  "35,4 38,8 37,27 34,31 30,27 31,8",
  "33,35 36,39 35,58 31,62 27,58 29,39",
  "0,64 4,60 26,60 30,64 26,67 4,67",
  "1,35 4,39 3,58 -1,62 -4,58 -3,39",
  "3,4 7,8 6,27 2,31 -1,27 0,8",
  "2,33 6,29 28,29 32,33 28,37 6,37",
];

/** Segments that are lit for the digits 0 to F: a in bit 0 to g in bit 6. */
const DIGITS = [0x3f, 0x06, 0x5b, 0x4f, 0x66, 0x6d, 0x7d, 0x07, 0x7f, 0x6f, 0x77, 0x7c, 0x39, 0x5e,
  0x79, 0x71];

/**
 * Read a display: its digits from the left, with a question mark for what is no digit.
 * @param {Uint8Array} display - duty of 32 segments, those of the rightmost digit first
 */
export function read(display) {
  const lit = (place) => [0, 1, 2, 3, 4, 5, 6].reduce(
    (mask, n) => mask | (display[8 * place + n] > 0) << n, 0);
  const digits = [3, 2, 1, 0].map(lit);
  if (!digits.some(Boolean)) return "dark";
  return digits.map((mask) => (mask ? DIGITS.indexOf(mask).toString(16).toUpperCase() : "dark"))
    .join(" ").replaceAll("-1", "?");
}

/** Draw the segments of a digit twice, dark and lit. */
export function digit() {
  const make = (kind) => [
    ...SEGMENTS.map((points) => svg("polygon", { points, class: kind })),
    svg("circle", { cx: 38, cy: 64, r: 3, class: kind }),
  ];
  const lit = make("segment-on");
  for (const segment of lit) segment.style.opacity = 0;
  return { dark: make("segment-off"), lit };
}

/** Draw the board itself, its chips and connectors. */
export function chips(name, [width, height]) {
  const board = [
    svg("rect", { width, height, rx: 12, class: "pcb" }),
    svg("rect", { x: 5, y: 5, width: width - 10, height: height - 10, rx: 8, class: "edge" }),
  ];
  return [...board, ...(name === "wide" ? wide() : narrow())];
}

function wide() {
  return [
    ...[[22, 22], [658, 22], [18, 354], [662, 354]].map(hole),
    connector(52, 0, 54, 26, "USB"), connector(124, 0, 62, 30, "POWER"),
    connector(214, 0, 118, 32, "VGA"), connector(350, 0, 118, 32, "RS-232"),
    connector(490, 0, 56, 34, "PS/2"),
    ...["JA", "JB", "JC", "JD"].map((pmod, n) => header(640, 42 + 54 * n, pmod)),
    socket(12, 44, 12, 170),
    chip(294, 62, 124, "SPARTAN-3E", "XC3S500E"),
    part(48, 60, 58, 34, "FLASH"), part(118, 60, 58, 34, "RAM"), part(188, 60, 44, 34, "XCF04S"),
    part(244, 66, 40, 24, "50 MHz"),
    part(462, 66, 40, 40, ""), part(520, 66, 34, 24, ""), part(520, 98, 34, 24, ""),
    label(520, 176, "NEXYS 2", "silk name"), label(520, 196, "drawn by Fresa", "silk small"),
    ...Array.from({ length: 12 }, (_, n) => svg("rect", {
      x: 462 + 10 * n, y: 134, width: 4, height: 8, class: "tiny" })),
  ];
}

function narrow() {
  return [
    connector(30, 0, 42, 20, "USB"), connector(96, 0, 74, 24, "VGA"),
    connector(190, 0, 74, 24, "RS-232"), connector(284, 0, 42, 24, "PS/2"),
    chip(252, 60, 92, "SPARTAN-3E", "XC3S500E"),
    label(180, 50, "NEXYS 2", "silk small"),
  ];
}

const hole = ([cx, cy]) => svg("circle", { cx, cy, r: 8, class: "hole" });

function connector(x, y, width, height, name) {
  return group(x, y, {},
    svg("rect", { y: -2, width, height, rx: 3, class: "metal" }),
    svg("rect", { x: 5, y: 3, width: width - 10, height: height - 10, rx: 2, class: "metal-in" }),
    label(width / 2, height + 11, name, "silk small"));
}

/** A Pmod connector: two rows of six. */
function header(x, y, name) {
  const holes = Array.from({ length: 12 }, (_, n) => svg("rect", {
    x: 5 + 13 * Math.floor(n / 6), y: 3 + 7.5 * (n % 6), width: 5, height: 5, class: "pin" }));
  return group(x, y, {}, svg("rect", { width: 28, height: 48, rx: 2, class: "black" }), ...holes,
    label(-12, 30, name));
}

function socket(x, y, width, height) {
  return group(x, y, {}, svg("rect", { width, height, rx: 3, class: "black" }),
    svg("path", { d: `M${width / 2} 8V${height - 8}`, class: "contacts" }));
}

function chip(x, y, side, ...names) {
  return group(x, y, {},
    svg("rect", { width: side, height: side, rx: 4, class: "black" }),
    svg("circle", { cx: 11, cy: 11, r: 3, class: "tiny" }),
    ...names.map((text, n) => label(side / 2, side / 2 + 14 * n, text, "print")));
}

function part(x, y, width, height, name) {
  return group(x, y, {}, svg("rect", { width, height, rx: 2, class: "black" }),
    label(width / 2, height / 2 + 3, name, "print small"));
}
