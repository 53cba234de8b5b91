/**
 * The table seen from above: plate, cut and path, on three canvases.
 *
 * Drawing is incremental: only new pixels and segments of the path are drawn.
 * All is drawn again when the size, the colours or the part of the table in view change. The
 * last segment still grows, so it is drawn with the tool, on a canvas that is cleared each time.
 */

const MARGIN = 0.05;

/** The table. X, the rows, grows downwards; Y, the columns, to the right; both in steps. */
export class Table {
  #drawn = { path: 0, cut: 0 };
  #view = { left: 0, top: 0, side: 1, scale: 1 };

  /** @param {HTMLElement} place - contains a canvas for each of the layers plate, way and tool */
  constructor(place) {
    this.place = place;
    this.rows = this.columns = 1;
    this.pitch = 128;
    this.target = [];
    this.machine = { path: [], cut: [], motors: [{ position: 0 }, { position: 0 }, {}] };
    this.layers = {};
    for (const canvas of place.querySelectorAll("canvas")) {
      this.layers[canvas.dataset.layer] = canvas.getContext("2d");
    }
    // A first frame may have to be drawn before the observer has seen the size.
    this.redraw();
    new ResizeObserver(() => this.redraw()).observe(place);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  /** Load another picture: its size, steps per pixel, and indices of its target pixels. */
  load(rows, columns, pitch, target) {
    Object.assign(this, { rows, columns, pitch, target });
    this.redraw();
  }

  /**
   * Draw what has changed.
   * @param {Machine} machine
   * @param {{path: number, cut: number}} from - the first of path and cut that may have changed
   */
  show(machine, from) {
    this.machine = machine;
    const began = from.path < this.#drawn.path || from.cut < this.#drawn.cut;
    if (began || !this.#inView()) this.redraw();
    else this.#drawNew();
  }

  /** Draw everything again, with the present size and colours. */
  redraw() {
    const side = this.place.clientWidth;
    const pixels = Math.max(1, Math.round(side * devicePixelRatio));
    for (const { canvas } of Object.values(this.layers)) canvas.width = canvas.height = pixels;
    this.#colours();
    this.#look(pixels);
    this.#drawn = { path: 0, cut: 0 };
    this.#drawPlate();
    this.#drawNew();
  }

  #colours() {
    const style = getComputedStyle(this.place);
    this.colour = {};
    for (const name of ["plate", "target", "cut", "air", "milled", "tool", "frame"]) {
      this.colour[name] = style.getPropertyValue(`--${name}`).trim();
    }
  }

  /** Fit the view to the plate and the path of the tool. */
  #look(pixels) {
    const half = this.pitch / 2;
    let [left, top] = [-half, -half];
    let [right, bottom] = [this.columns * this.pitch - half, this.rows * this.pitch - half];
    for (const { x, y } of this.#places()) {
      [left, right] = [Math.min(left, y), Math.max(right, y)];
      [top, bottom] = [Math.min(top, x), Math.max(bottom, x)];
    }
    const size = Math.max(right - left, bottom - top);
    const side = size * (1 + 2 * MARGIN);
    this.#view = {
      left: (left + right - side) / 2, top: (top + bottom - side) / 2, side, scale: pixels / side,
    };
    Object.assign(this.place.dataset, this.#view);
  }

  *#places() {
    yield* this.machine.path;
    yield { x: this.machine.motors[0].position, y: this.machine.motors[1].position };
  }

  #inView() {
    const { left, top, side } = this.#view;
    const { path, motors } = this.machine;
    const [x, y] = [motors[0].position, motors[1].position];
    const inside = (p) => p.x >= top && p.x <= top + side && p.y >= left && p.y <= left + side;
    return inside({ x, y }) && path.slice(this.#drawn.path).every(inside);
  }

  #across(y) { return (y - this.#view.left) * this.#view.scale; }
  #down(x) { return (x - this.#view.top) * this.#view.scale; }

  #drawPlate() {
    const context = this.layers.plate;
    const half = this.pitch / 2;
    const [x, y] = [this.#across(-half), this.#down(-half)];
    const width = this.columns * this.pitch * this.#view.scale;
    const height = this.rows * this.pitch * this.#view.scale;
    context.fillStyle = this.colour.plate;
    context.fillRect(x, y, width, height);
    context.strokeStyle = this.colour.frame;
    context.strokeRect(x, y, width, height);
    this.#fill(this.target, 0, this.colour.target);
  }

  /** Fill pixels, by index. Their edges are aligned to the screen's pixels, so that no seam shows. */
  #fill(numbers, first, colour) {
    const context = this.layers.plate;
    const half = this.pitch / 2;
    context.fillStyle = colour;
    for (let n = first; n < numbers.length; n += 1) {
      const row = Math.floor(numbers[n] / this.columns);
      const column = numbers[n] % this.columns;
      const x = Math.round(this.#across(column * this.pitch - half));
      const y = Math.round(this.#down(row * this.pitch - half));
      const right = Math.round(this.#across((column + 1) * this.pitch - half));
      const bottom = Math.round(this.#down((row + 1) * this.pitch - half));
      context.fillRect(x, y, right - x, bottom - y);
    }
  }

  #drawNew() {
    const { path, cut } = this.machine;
    this.#fill(cut, this.#drawn.cut, this.colour.cut);
    // The last corner may still move.
    const done = Math.max(this.#drawn.path, path.length - 1, 0);
    this.#stroke(this.layers.way, path, Math.max(1, this.#drawn.path), done);
    this.#drawn = { path: done, cut: cut.length };
    this.#drawTool();
  }

  /** Draw the segments that end in the corners from `first` to before `end`. */
  #stroke(context, path, first, end) {
    for (const cut of [false, true]) {
      context.beginPath();
      for (let n = first; n < end; n += 1) {
        if (path[n].cut !== cut) continue;
        context.moveTo(this.#across(path[n - 1].y), this.#down(path[n - 1].x));
        context.lineTo(this.#across(path[n].y), this.#down(path[n].x));
      }
      context.strokeStyle = cut ? this.colour.milled : this.colour.air;
      context.lineWidth = devicePixelRatio * (cut ? 1.2 : 1);
      context.stroke();
    }
  }

  #drawTool() {
    const context = this.layers.tool;
    const { path, motors } = this.machine;
    context.clearRect(0, 0, context.canvas.width, context.canvas.height);
    if (path.length > 1) this.#stroke(context, path, path.length - 1, path.length);
    const [x, y] = [this.#across(motors[1].position), this.#down(motors[0].position)];
    const radius = 6 * devicePixelRatio;
    context.strokeStyle = this.colour.tool;
    context.lineWidth = 2 * devicePixelRatio;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      context.moveTo(x + dx * radius * 0.5, y + dy * radius * 0.5);
      context.lineTo(x + dx * radius * 1.9, y + dy * radius * 1.9);
    }
    context.stroke();
  }
}

/**
 * Return the target pixels of a picture: the dark ones.
 * @param {HTMLImageElement} image
 * @returns {number[]} their indices, row by row
 */
export function darkPixels(image) {
  const canvas = document.createElement("canvas");
  canvas.width = image.naturalWidth;
  canvas.height = image.naturalHeight;
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0);
  const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
  const dark = [];
  for (let n = 0; n < data.length / 4; n += 1) if (data[4 * n] < 128) dark.push(n);
  return dark;
}
