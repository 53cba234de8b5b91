/** Makes SVG elements. */

const SPACE = "http://www.w3.org/2000/svg";

/**
 * Make an element.
 * @param {string} name - tag
 * @param {Object<string, string|number>} [attributes]
 * @param {...(Node|string)} children
 * @returns {SVGElement}
 */
export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.append(...children);
  return element;
}

/** Make a group moved to (x, y). */
export function group(x, y, attributes = {}, ...children) {
  return svg("g", { transform: `translate(${x} ${y})`, ...attributes }, ...children);
}

/** Make a text whose middle is at x. */
export function label(x, y, text, kind = "silk") {
  return svg("text", { x, y, class: kind, "text-anchor": "middle" }, text);
}
