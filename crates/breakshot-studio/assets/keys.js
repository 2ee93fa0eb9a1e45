/** Every key of the page: what it does, and the list of all of them. */

import { byId, html } from "/elements.js";

const groups = [];

/** Whether the focus is where letters are written. */
const isWriting = (target) =>
  target.matches?.("input:not([type=checkbox], [type=range]), textarea, select") || target.isContentEditable;

const nameOf = (event) =>
  (event.ctrlKey || event.metaKey ? "Ctrl+" : "") + (event.altKey ? "Alt+" : "") +
  (event.shiftKey && event.key.length > 1 ? "Shift+" : "") + (event.key === " " ? "Space" : event.key);

/**
 * Adds keys: a list of `[names, words, act]`; `act` gets the key's name. `view` is the view in which they count, all without it. `isFor` says
 * for which focus they count; without it they count everywhere but in fields.
 */
export function addKeys({ title, view = null, isFor = null }, keys) {
  groups.push({ title, view, isFor, keys });
}

const isShown = ({ view }) => view === null || document.body.dataset.view === view;

/** The key that this event asks for; keys of what has the focus come first. */
function wanted(event) {
  const name = nameOf(event);
  const fits = ({ isFor }) => (isFor ? isFor(event.target) : !isWriting(event.target) || /^(Ctrl|Alt)\+/.test(name));
  const here = groups.filter(isShown);
  const ordered = [...here.filter((group) => group.isFor), ...here.filter((group) => !group.isFor)];
  for (const group of ordered.filter(fits)) {
    const key = group.keys.find(([names]) => names.includes(name));
    if (key) return () => key[2](name, event);
  }
  return null;
}

function shown(name) {
  const signs = { ArrowLeft: "\u2190", ArrowRight: "\u2192", ArrowUp: "\u2191", ArrowDown: "\u2193", PageUp: "Page up", PageDown: "Page down" };
  const parts = name.split(/\+(?=.)/).flatMap((part) => (/^[A-Z]$/.test(part) ? ["Shift", part] : [part]));
  return parts.map((part) => html("kbd", {}, signs[part] ?? part));
}

function list() {
  return groups.filter(isShown).map(({ title, keys }) =>
    html("section", {}, html("h3", {}, title), html("dl", {}, ...keys.flatMap(([names, words]) => [
      html("dt", {}, ...names.filter((name) => !name.startsWith("Shift+")).flatMap((name, k) => (k ? [" ", ...shown(name)] : shown(name)))),
      html("dd", {}, words),
    ]))),
  );
}

/** Shows the list of keys. */
export function showKeys() {
  byId("key-list").replaceChildren(...list());
  byId("keys").showModal();
}

/** Listens to the keyboard. */
export function startKeys() {
  addKeys({ title: "Everywhere" }, [[["?"], "this list", showKeys]]);
  byId("help").addEventListener("click", showKeys);
  document.addEventListener("keydown", (event) => {
    if (document.querySelector("dialog[open]")) return;
    // A button is pressed with the space bar, as everywhere.
    if ((event.key === " " || event.key === "Enter") && event.target.matches?.("button, summary, a")) return;
    const act = wanted(event);
    if (!act) return;
    event.preventDefault();
    act();
  });
}
