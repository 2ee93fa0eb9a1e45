/** A pile from a picture: its scene is written as `breakshot look` writes it; and a picture beneath the objects. */

import { byId, fillSelect, onDrop, svg } from "/elements.js";
import { addKeys } from "/keys.js";
import { ask, read, send } from "/server.js";

const stem = (name) => name.replace(/^.*\//, "").replace(/(\.scene)?\.[^.]+$/, "");

export class FromPicture {
  #pile;
  #message;
  #version = 0;

  /** `pile` has `contents`, `file`, `scene`, `table` and `created(file)`. */
  constructor(pile, message) {
    this.#pile = pile;
    this.#message = message;
    byId("from-picture").addEventListener("click", () => this.ask());
    byId("beneath").addEventListener("change", () => this.draw());
    byId("picture-file").addEventListener("change", () => this.#fill().catch(message.error));
    byId("picture-objects").addEventListener("change", () => this.#fill().catch(message.error));
    const dialog = byId("new-picture");
    dialog.addEventListener("close", () => dialog.returnValue === "take" && this.#take().catch(message.error));
    this.#addDrop();
    addKeys({ title: "Pictures", view: "pile" }, [
      [["f"], "take the pile from a picture", () => this.ask()],
      [["i"], "the picture beneath the objects on or off", () => this.#toggle()],
    ]);
  }

  get #pictures() {
    return [...this.#pile.contents.pictures, ...this.#pile.contents.films];
  }

  /** Shows the files of the project. */
  show() {
    const { value } = byId("beneath");
    fillSelect(byId("beneath"), [["", "none"], ...this.#pictures.map((name) => [name, name])], this.#pictures.includes(value) ? value : "");
    byId("from-picture").disabled = !this.#canTake;
  }

  get #canTake() {
    const { cells, objects } = this.#pile.contents;
    return Boolean(cells.length && objects.length && this.#pictures.length);
  }

  /** Asks for the picture, what lies in it, and the name of the scene. */
  ask(picture = this.#likely()) {
    if (!this.#canTake) return this.#message.error(new Error("A pile is taken from a picture or film of this folder with a cell and objects."));
    const { cells, objects, scenes } = this.#pile.contents;
    const names = (list) => list.map((name) => [name, name]);
    fillSelect(byId("picture-cell"), names(cells));
    fillSelect(byId("picture-objects"), names(objects));
    fillSelect(byId("picture-file"), names(this.#pictures), picture);
    const base = stem(byId("picture-file").value);
    let name = `${base}.scene.toml`;
    for (let k = 2; scenes.includes(name); k += 1) name = `${base}_${k}.scene.toml`;
    byId("picture-name").value = name;
    byId("new-picture").returnValue = "";
    byId("new-picture").showModal();
    return this.#fill().catch(this.#message.error);
  }

  /** The picture of the scene's name, or the first one. */
  #likely() {
    const own = this.#pile.file && stem(this.#pile.file);
    return this.#pictures.find((name) => stem(name) === own) ?? this.#pictures[0];
  }

  /** The objects of the picture: those in its name, or those that are on the table. */
  async #fill() {
    const fields = { objects: byId("picture-objects").value, name: byId("picture-file").value };
    const named = await read("/api/picture-draft", fields);
    const placed = this.#pile.placed.map(({ object }) => object);
    byId("picture-names").value = (named.length ? named : placed).join(", ");
  }

  async #take() {
    const [cell, objects, picture, output] = ["picture-cell", "picture-objects", "picture-file", "picture-name"].map((id) => byId(id).value);
    const names = byId("picture-names").value.split(",").map((name) => name.trim()).filter(Boolean);
    this.#message.tell(`Looking for ${names.join(", ")} in ${picture} \u2026`);
    const { file, warnings } = await ask("/api/picture", { cell, objects, picture, names, output });
    await this.#pile.created(file);
    byId("beneath").value = picture;
    this.draw();
    this.#message.tell(`Wrote ${file}, as breakshot look does. ${warnings.join(" ")}`);
  }

  #toggle() {
    const list = byId("beneath");
    list.value = list.value ? "" : this.#likely() ?? "";
    this.draw();
  }

  /** The scene's file was written: what lies where in the picture may be another thing. */
  renew() {
    this.#version += 1;
    this.draw();
  }

  /** Draws the picture, or none. */
  draw() {
    const layer = this.#pile.table.layer("picture");
    const picture = byId("beneath").value;
    document.body.classList.toggle("with-picture", Boolean(picture && this.#pile.scene));
    if (!picture || !this.#pile.scene) return layer.replaceChildren();
    const href = `/api/beneath?${new URLSearchParams({ scene: this.#pile.file, picture, version: this.#version })}`;
    let image = layer.firstChild;
    if (image?.getAttribute("href") !== href) {
      image = svg("image", { href, preserveAspectRatio: "none" });
      image.addEventListener("error", () => this.#failed(href));
      layer.replaceChildren(image);
    }
    const { min_m: low, max_m: high } = this.#pile.scene.cell.workspace;
    const [[x, y], [right, bottom]] = [this.#pile.table.px([low[0], high[1]]), this.#pile.table.px([high[0], low[1]])];
    for (const [name, value] of Object.entries({ x, y, width: right - x, height: bottom - y })) image.setAttribute(name, value.toFixed(2));
    return null;
  }

  /** The reason why there is no picture. */
  async #failed(href) {
    byId("beneath").value = "";
    this.draw();
    const response = await fetch(href).catch(() => null);
    const answer = response && !response.ok ? await response.json() : { error: "The picture cannot be shown." };
    this.#message.error(new Error(answer.error));
  }

  #addDrop() {
    onDrop(byId("pile"), ([file]) => this.#add(file).catch(this.#message.error));
    byId("picture-picker").addEventListener("change", ({ target }) => {
      this.#add(target.files[0]).catch(this.#message.error);
      target.value = "";
    });
    byId("picture-add").addEventListener("click", () => byId("picture-picker").click());
  }

  /** Copies a picture or film into the folder and asks what lies in it. */
  async #add(file) {
    if (!file) return;
    const added = await send("/api/upload", { name: file.name }, file, () => {});
    const { pictures, films } = this.#pile.contents;
    (added.name.toLowerCase().endsWith(".png") ? pictures : films).push(added.name);
    this.show();
    if (byId("new-picture").open) byId("new-picture").close();
    this.ask(added.name);
  }
}
