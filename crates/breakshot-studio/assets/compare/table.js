/** The table of a comparison from above: filmed and simulated objects over each other. */

import { byId, svg } from "/elements.js";
import { path, pose } from "/motion.js";
import { Table } from "/table.js";

export class TablePane {
  #shown = null;
  #at = [0, 0];

  constructor() {
    this.table = new Table(byId("compare-ground"), byId("compare-top"));
    new ResizeObserver(() => this.resize()).observe(byId("compare-table"));
  }

  /** Shows the table of a comparison; returns the class that sets an object's colour. */
  show(shown) {
    this.#shown = shown;
    this.#ground();
    return (name) => this.table.colour(name);
  }

  /** Draws everything at the width that there is. */
  resize() {
    if (!this.#shown || byId("compare-table").hidden) return;
    this.#ground();
    this.at(...this.#at);
  }

  #ground() {
    const { scene, objects, trajectory } = this.#shown;
    this.table.show(scene);
    const paths = objects.flatMap(({ name, samples }) => {
      const filmed = samples.filter((shot) => shot && !shot.is_doubtful).map((shot) => shot.position_m);
      return [
        svg("path", { class: `path ${this.table.colour(name)}`, d: this.table.line(filmed) }),
        svg("path", { class: `path simulated-path ${this.table.colour(name)}`, d: this.table.line(path(trajectory, name)) }),
      ];
    });
    this.table.layer("paths").replaceChildren(...paths);
  }

  /** Shows the objects of a frame, and their simulation at an instant. */
  at(number, instant) {
    this.#at = [number, instant];
    const { objects, trajectory, scene, report } = this.#shown;
    const drawn = objects.flatMap(({ name, samples }) => {
      const shape = this.table.shape(name);
      if (!shape) return [];
      const shot = samples[number];
      const isLinked = shot && report.alignment;
      const simulated = pose(trajectory, name, isLinked ? shot.time_s : Math.max(0, instant));
      const outline = (one, kind) => svg("path", { class: `${kind} ${this.table.colour(name)}`, d: this.table.outline(shape), transform: this.table.placed(one) });
      const filmed = shot && [...shot.position_m, shot.yaw_rad ?? 0];
      return [
        filmed && outline(filmed, shot.is_doubtful ? "before" : "current"),
        simulated && outline(simulated, "expected"),
        isLinked && simulated && svg("path", { class: "link", d: this.table.line([shot.position_m, simulated.slice(0, 2)]) }),
        filmed && this.#name(name, filmed),
      ].filter(Boolean);
    });
    this.table.layer("objects").replaceChildren(...drawn);
    const striker = pose(trajectory, "striker", Math.max(0, instant));
    const { shape } = scene.cell.striker;
    this.table.layer("strike").replaceChildren(...(striker ? [svg("path", { class: "striker", d: this.table.outline(shape), transform: this.table.placed(striker) })] : []));
  }

  #name(name, [x, y]) {
    const [left, top] = this.table.px([x, y]);
    return svg("text", { class: "name halo", x: left, y: top + 4, "text-anchor": "middle" }, name);
  }
}
