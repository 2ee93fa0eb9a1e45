/** The list of the objects: their poses as numbers, more of them, fewer of them. */

import { byId, degrees, fillSelect, fixed, html, mm } from "/elements.js";

export class ObjectList {
  #pile;
  #rows = new Map();

  constructor(pile) {
    this.#pile = pile;
    byId("add").addEventListener("click", () => this.add());
  }

  /** The kinds that can be added. */
  showKinds(objects) {
    fillSelect(byId("kind"), objects.map(({ name }) => [name, name]));
  }

  /** Adds an object of the chosen kind at the freest place. */
  add() {
    const kind = byId("kind").value;
    if (!kind) return;
    this.#pile.edit();
    const object = this.#pile.newName(kind);
    this.#pile.placed = [...this.#pile.placed, { object, position_m: this.#pile.freePlace(), yaw_rad: 0 }];
    this.#pile.replaced();
    this.#pile.select(object);
  }

  draw() {
    this.#rows.clear();
    for (const { object } of this.#pile.placed) this.#rows.set(object, this.#row(object));
    byId("objects").tBodies[0].replaceChildren(...this.#rows.values());
    this.update();
  }

  #row(object) {
    const remove = html("button", { type: "button", class: "icon", "aria-label": `Remove ${object}`, title: `Remove ${object}`, onclick: () => this.#pile.remove(object) }, "\u00d7");
    const swatch = html("span", { class: `swatch ${this.#pile.table.colour(object)}` });
    return html("tr", {}, html("th", { scope: "row" }, swatch, object), html("td"), html("td"), html("td"), html("td", {}, remove));
  }

  update() {
    for (const { object, position_m: [x, y], yaw_rad } of this.#pile.placed) {
      const cells = this.#rows.get(object)?.cells;
      if (!cells) continue;
      cells[1].textContent = mm(x);
      cells[2].textContent = mm(y);
      cells[3].textContent = fixed(degrees(yaw_rad), 1);
    }
  }

  select(name) {
    for (const [object, row] of this.#rows) row.classList.toggle("selected", object === name);
  }
}
