/** A new pile: a scene file of a cell and objects of the project. */

import { byId, fillSelect } from "/elements.js";
import { ask } from "/server.js";

/** The choice that leads here. */
export const NEW = "+ new pile";

/** Asks for cell, objects and name; `opened(file, contents)` gets the file that was written. */
export function startNew(contents, message, opened) {
  const dialog = byId("new-scene");
  fillSelect(byId("new-cell"), contents.cells.map((name) => [name, name]));
  fillSelect(byId("new-objects"), contents.objects.map((name) => [name, name]));
  dialog.addEventListener("close", async () => {
    if (dialog.returnValue !== "create") return opened(null);
    const question = { cell: byId("new-cell").value, objects: byId("new-objects").value, output: byId("new-name").value };
    const file = await ask("/api/new", question).catch(message.error);
    return opened(file ?? null);
  });
}

/** Shows the question. */
export function askForNew(contents) {
  const taken = new Set(contents.scenes);
  let name = "pile.scene.toml";
  for (let k = 2; taken.has(name); k += 1) name = `pile_${k}.scene.toml`;
  byId("new-name").value = name;
  byId("new-scene").returnValue = "";
  byId("new-scene").showModal();
}
