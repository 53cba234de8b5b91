/** The dialog that uploads a picture as the job of the board. */

const find = (id) => document.getElementById(id);

/** Milliseconds without input before a new preview is requested. */
const PATIENCE = 200;

/** Preview and upload of a picture. */
export class Job {
  #request = null;
  #timer = 0;
  #picture = null;

  /** @param {function(string): Promise<boolean>} mayEnd - whether a running job may be ended */
  constructor(mayEnd) {
    this.mayEnd = mayEnd;
    this.dialog = find("job-dialog");
    this.form = find("job-form");
    find("choose").addEventListener("click", () => this.dialog.showModal());
    find("cancel").addEventListener("click", () => this.dialog.close());
    this.form.addEventListener("input", () => {
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#preview(), PATIENCE);
    });
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#program();
    });
  }

  /** Set the largest size of a picture. */
  limits({ picture_max: most }) { this.form.elements.size.max = most; }

  /** The options of `tools.image`, by name. */
  #query() {
    const fields = new FormData(this.form);
    const query = new URLSearchParams({ size: `${fields.get("size")}x${fields.get("size")}` });
    for (const name of ["threshold", "turn", "mirror"]) {
      if (fields.get(name)) query.set(name, fields.get(name));
    }
    if (fields.get("figure")) query.set(fields.get("figure"), "1");
    if (fields.get("invert")) query.set("invert", "1");
    query.set("name", find("file").files[0].name.slice(0, 100));
    return query;
  }

  async #post(place) {
    this.#request?.abort();
    this.#request = new AbortController();
    const response = await fetch(`${place}?${this.#query()}`, {
      method: "POST", body: find("file").files[0], signal: this.#request.signal });
    if (response.ok) return response;
    const { error } = await response.json().catch(() => ({}));
    throw new Error(error ?? `the server answered ${response.status}`);
  }

  async #preview() {
    if (!find("file").files.length || !this.form.checkValidity()) return this.#show(null);
    return this.#attempt(async () => this.#show(await (await this.#post("job/preview")).blob()));
  }

  async #program() {
    if (!await this.mayEnd("Program the board")) return undefined;
    find("program").disabled = true;
    return this.#attempt(async () => {
      await this.#post("job");
      this.dialog.close();
      find("program").disabled = false;
    });
  }

  /** Run a request, and show its error if it fails. */
  async #attempt(work) {
    find("job-error").textContent = "";
    try {
      await work();
    } catch (error) {
      if (error.name === "AbortError") return;
      this.#show(null);
      find("job-error").textContent = error instanceof TypeError
        ? "The picture could not be sent: is it too large, or the connection lost?"
        : error.message;
    }
  }

  #show(picture) {
    const image = find("preview");
    if (this.#picture) URL.revokeObjectURL(this.#picture);
    this.#picture = picture && URL.createObjectURL(picture);
    if (picture) image.src = this.#picture;
    else image.removeAttribute("src");
    image.hidden = picture === null;
    find("preview-note").hidden = picture !== null;
    find("program").disabled = picture === null;
  }
}
