/** The seven points: fields to edit, a button to store the position, a button to move there. */

import { ask } from "./ask.js";

const AXES = ["x", "y", "z"];

/** The table of points. A point is stored when one of its fields loses the focus. */
export class Points {
  #rows = [];

  /**
   * @param {HTMLElement} body - the parent of the rows
   * @param {function(string, object)} send - sends a request, see `Link.send`
   */
  constructor(body, send) {
    this.body = body;
    this.send = send;
  }

  /** Show the stored points. A field that is being edited is left alone. */
  show(points, travel) {
    while (this.#rows.length < points.length) this.#add(this.#rows.length + 1, travel);
    points.forEach((point, index) => {
      this.#rows[index].fields.forEach((field, axis) => {
        if (field !== document.activeElement) field.value = point[axis] ?? "";
      });
    });
    this.points = points;
  }

  /** Enable the buttons that can be used, and mark the goal of a movement. */
  enable(connected, goal) {
    this.#rows.forEach(({ row, here, go }, index) => {
      here.disabled = !connected;
      go.disabled = !connected || this.points[index].includes(null);
      row.classList.toggle("going", goal === index + 1);
    });
  }

  #add(number, travel) {
    const row = document.createElement("tr");
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = number;
    row.append(head);
    const fields = AXES.map((axis) => {
      const field = Object.assign(document.createElement("input"), {
        id: `point-${number}-${axis}`, type: "number", step: "any", min: -travel, max: travel,
      });
      field.setAttribute("aria-label", `${axis.toUpperCase()} of point ${number}, in um`);
      field.addEventListener("change", () => this.#store(number, fields));
      field.addEventListener("keydown", ({ key }) => { if (key === "Enter") field.blur(); });
      const cell = document.createElement("td");
      cell.append(field);
      row.append(cell);
      return field;
    });
    const here = this.#button("Here", `here-${number}`, `Store this position as point ${number}`);
    here.addEventListener("click", async () => {
      const old = this.points[number - 1];
      if (old.every((um) => um === null)
        || await ask(`Point ${number} is (${old.map((um) => um ?? "–").join(", ")}). Store this `
          + "position instead?", "Store")) this.send("here", { number });
    });
    const go = this.#button("Go", `go-${number}`, `Go to point ${number}`);
    go.classList.add("go");
    go.addEventListener("click", () => this.send("go", { number }));
    const cell = document.createElement("td");
    cell.className = "act";
    cell.append(here, " ", go);
    row.append(cell);
    this.body.append(row);
    this.#rows.push({ row, fields, here, go });
  }

  #button(text, id, label) {
    const button = Object.assign(document.createElement("button"), { type: "button", id });
    button.textContent = text;
    button.setAttribute("aria-label", label);
    button.title = label;
    return button;
  }

  #store(number, fields) {
    if (!fields.every((field) => field.reportValidity())) return;
    const place = fields.map(({ value }) => (value === "" ? null : Number(value)));
    this.send("point", { number, place });
  }
}
