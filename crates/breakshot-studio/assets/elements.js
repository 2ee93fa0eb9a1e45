/** Elements of the page and of drawings, and numbers as text. */

/** Says what is missing where a view has nothing to show; `parts` may hold elements. */
export function showNothing(view, ...parts) {
  const main = byId(view);
  main.classList.add("empty");
  main.querySelector(".nothing").replaceChildren(...parts);
}

/** The element with this id. */
export const byId = (id) => document.getElementById(id);

function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** An element of a page. */
export const html = (tag, attributes = {}, ...children) => filled(document.createElement(tag), attributes, children);

/** An element of a drawing. */
export const svg = (tag, attributes = {}, ...children) =>
  filled(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

/** A sentence whose names between backticks are set as code. */
export const prose = (text) => text.split("`").map((part, k) => (k % 2 ? html("code", {}, part) : part));

/** A number with so many decimals, and a true minus sign. */
export function fixed(value, decimals = 0) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "\u2212");
}

/** A length in metres as millimetres. */
export const mm = (metres, decimals = 1) => fixed(metres * 1e3, decimals);

/** An angle in radians as degrees. */
export const degrees = (rad) => (rad * 180) / Math.PI;

/** An angle between minus and plus half a turn. */
export const wrapped = (rad) => Math.atan2(Math.sin(rad), Math.cos(rad));

/** A point at a distance from another along a heading. */
export const along = ([x, y], heading, distance) => [x + Math.cos(heading) * distance, y + Math.sin(heading) * distance];

/** The distance of two points. */
export const distance = ([x, y], [u, v]) => Math.hypot(u - x, v - y);

/** Takes the files that are dropped onto a view, which shows that they can be. */
export function onDrop(view, take) {
  view.addEventListener("dragover", (event) => {
    event.preventDefault();
    view.classList.add("dropping");
  });
  view.addEventListener("dragleave", () => view.classList.remove("dropping"));
  view.addEventListener("drop", (event) => {
    event.preventDefault();
    view.classList.remove("dropping");
    take([...event.dataTransfer.files]);
  });
}

/** The choices of a list, the chosen one first asked for. */
export function fillSelect(select, choices, chosen) {
  select.replaceChildren(
    ...choices.map(([value, text]) => html("option", { value, selected: value === chosen }, text)),
  );
}

/** Sets a field unless a person is writing in it. */
export function setField(field, value, decimals) {
  if (document.activeElement === field && field.dataset.edited) return;
  field.value = Number(value.toFixed(decimals));
}
