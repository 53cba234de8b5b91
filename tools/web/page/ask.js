/** Questions before something is lost that cannot be had back. */

let open = null;

/**
 * Ask a question, and wait for the answer. A question that is asked already is answered no.
 * @param {string} question
 * @param {string} yes - what is done, for its button
 * @returns {Promise<boolean>} false also if the question is left by Escape
 */
export function ask(question, yes) {
  open?.close();
  const dialog = document.createElement("dialog");
  const text = document.createElement("p");
  text.textContent = question;
  text.id = "question";
  dialog.setAttribute("aria-labelledby", text.id);
  const row = document.createElement("form");
  row.method = "dialog";
  row.className = "row end";
  for (const [value, label] of [["", "Cancel"], ["yes", yes]]) {
    const button = document.createElement("button");
    Object.assign(button, { value, textContent: label, autofocus: !value });
    row.append(button);
  }
  dialog.append(text, row);
  dialog.className = "ask";
  document.body.append(dialog);
  dialog.showModal();
  open = dialog;
  return new Promise((answer) => {
    dialog.addEventListener("close", () => {
      if (open === dialog) open = null;
      dialog.remove();
      answer(dialog.returnValue === "yes");
    });
  });
}
