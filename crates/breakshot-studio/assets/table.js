/** The table from above, to scale: what lies there, the strike, and where everything may come to rest. */

import { along, svg } from "/elements.js";
import { outline, placed } from "/outlines.js";

/** Room around the workspace, as a part of its longer side. */
const MARGIN = 0.035;
/** Room below the table for the scale (px). */
const FOOT_PX = 26;
/** Room for the name of an object (px). */
const NAME_PX = 24;
const SCALES_M = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2];
/** Groups of the drawing below, which changes seldom or is large and is painted by itself, and of the one above it. */
const BELOW = ["ground", "picture", "cloud"];
const ABOVE = ["paths", "expected", "objects", "map", "strike"];

/** The kind of an object: `a` for its second copy `a#2`. */
export const kindOf = (name) => name.split("#")[0];

export class Table {
  #layers = {};
  #scale = 1;
  #low = [0, 0];
  #high = [1, 1];

  /** `below` and `element` lie on each other. */
  constructor(below, element) {
    this.below = below;
    this.element = element;
    this.scene = null;
    for (const name of [...BELOW, ...ABOVE]) this.#layers[name] = svg("g", { class: `layer-${name}` });
    below.replaceChildren(...BELOW.map((name) => this.#layers[name]));
    element.replaceChildren(...ABOVE.map((name) => this.#layers[name]));
  }

  /** The group of the drawing with this name. */
  layer(name) {
    return this.#layers[name];
  }

  /** The scale of the drawing (px/m). */
  get scale() {
    return this.#scale;
  }

  /** The place of a point of the table in the drawing (px). */
  px([x, y]) {
    return [(x - this.#low[0]) * this.#scale, (this.#high[1] - y) * this.#scale];
  }

  /** The point of the table under a pointer (m). */
  point(event) {
    const box = this.element.getBoundingClientRect();
    const ratio = this.element.viewBox.baseVal.width / box.width;
    return [
      this.#low[0] + ((event.clientX - box.left) * ratio) / this.#scale,
      this.#high[1] - ((event.clientY - box.top) * ratio) / this.#scale,
    ];
  }

  /** Calls `drag(event)` while a pointer moves over the table, and `release()` when it is lifted. */
  onPointer(drag, release) {
    this.element.addEventListener("pointermove", drag);
    for (const end of ["pointerup", "pointercancel"]) this.element.addEventListener(end, release);
  }

  /** Shows the table of a scene, as wide as there is room. */
  show(scene) {
    this.scene = scene;
    const { min_m, max_m } = scene.cell.workspace;
    const outline = scene.cell.table?.outline_m ?? [];
    const all = [min_m, max_m, ...outline, ...scene.walls.flatMap((wall) => [wall.from_m, wall.to_m])];
    const room = MARGIN * Math.max(max_m[0] - min_m[0], max_m[1] - min_m[1]);
    this.#low = [0, 1].map((k) => Math.min(...all.map((p) => p[k])) - room);
    this.#high = [0, 1].map((k) => Math.max(...all.map((p) => p[k])) + room);
    const width = Math.max(320, Math.round(this.element.clientWidth));
    this.#scale = width / (this.#high[0] - this.#low[0]);
    const height = (this.#high[1] - this.#low[1]) * this.#scale + FOOT_PX;
    for (const drawing of [this.below, this.element]) drawing.setAttribute("viewBox", `0 0 ${width} ${height.toFixed(1)}`);
    this.#drawGround(scene, width, height);
  }

  /** The class that sets an object's colour: by the rank of its kind, as in the report. */
  colour(name) {
    const kinds = [...new Set(this.scene.objects.map((object) => object.name))].sort();
    const rank = kinds.indexOf(kindOf(name));
    return rank < 0 ? "grey" : `c${rank % 8}`;
  }

  /** The outline of an object's kind. */
  shape(name) {
    return this.scene.objects.find((object) => object.name === kindOf(name))?.shape;
  }

  /** An outline about its centre, as the `d` of a path. */
  outline(shape) {
    return outline(shape, this.#scale);
  }

  /** The `transform` that puts an outline at a pose. */
  placed([x, y, yaw]) {
    return placed(this.px([x, y]), yaw);
  }

  /** A line through points, as the `d` of a path. */
  line(points) {
    return points.map((point, k) => (k ? "L" : "M") + this.px(point).map((v) => v.toFixed(2)).join(" ")).join("");
  }

  /** Shows possible final poses: a faint outline for each world. */
  showCloud(cloud) {
    const group = this.#layers.cloud;
    const count = Object.values(cloud ?? {}).reduce((sum, poses) => sum + poses.length, 0);
    while (group.childElementCount > count) group.lastChild.remove();
    while (group.childElementCount < count) group.append(svg("path"));
    let k = 0;
    for (const [name, poses] of Object.entries(cloud ?? {})) {
      const d = this.outline(this.shape(name));
      for (const one of poses) {
        const path = group.children[k++];
        // While a strike is dragged only the poses change.
        if (path.outline !== d || path.object !== name) {
          path.setAttribute("class", `possible ${this.colour(name)}`);
          path.setAttribute("d", d);
          [path.outline, path.object] = [d, name];
        }
        path.setAttribute("transform", this.placed(one));
      }
    }
  }

  /** Shows the nominal paths of the centres and the final poses. */
  showExpected(paths, final) {
    const drawnPaths = Object.entries(paths).map(([name, points]) =>
      svg("path", { class: `path ${this.colour(name)}`, d: this.line(points) }));
    this.#layers.paths.replaceChildren(...drawnPaths);
    const outlines = Object.entries(final).map(([name, one]) =>
      svg("path", { class: `expected ${this.colour(name)}`, d: this.outline(this.shape(name)), transform: this.placed(one) }));
    const names = Object.entries(final).filter(([name, [x, y]]) => this.#hasMoved(paths[name], [x, y])).map(([name, [x, y]]) => {
      const [u, v] = this.px([x, y]);
      return svg("text", { class: "name halo", x: u, y: v + 5, "text-anchor": "middle" }, name);
    });
    this.#layers.expected.replaceChildren(...outlines, ...names);
  }

  /** Whether the end of a path is so far from its start that two names do not lie on each other. */
  #hasMoved(points, end) {
    if (!points?.length) return false;
    const [[u, v], [x, y]] = [this.px(points[0]), this.px(end)];
    return Math.hypot(x - u, y - v) > NAME_PX;
  }

  #drawGround(scene, width, height) {
    const { min_m, max_m } = scene.cell.workspace;
    const box = [min_m, [max_m[0], min_m[1]], max_m, [min_m[0], max_m[1]]];
    const parts = [svg("path", { class: "workspace", d: `${this.line(box)}Z` })];
    if (scene.cell.table) parts.unshift(svg("path", { class: "table", d: `${this.line(scene.cell.table.outline_m)}Z` }));
    const grid = this.#grid(min_m, max_m);
    const [x, y] = this.px([min_m[0], max_m[1]]);
    const walls = scene.walls.map((wall) => svg("path", { class: "wall", d: this.line([wall.from_m, wall.to_m]) }));
    const areas = scene.keep_out.flatMap((area) => {
      const middle = [0, 1].map((k) => area.points_m.reduce((sum, p) => sum + p[k], 0) / area.points_m.length);
      const [mx, my] = this.px(middle);
      return [
        svg("path", { class: "keep-out", d: `${this.line(area.points_m)}Z` }),
        svg("text", { class: "small", x: mx, y: my + 4, "text-anchor": "middle" }, "keep out"),
      ];
    });
    const words = svg("text", { class: "small muted", x: x + 8, y: y + 16 }, "workspace");
    this.#layers.ground.replaceChildren(...parts, grid, ...areas, ...walls, words, this.#scaleBar(width, height));
  }

  /** Lines at every tenth of a metre. */
  #grid([left, low], [right, high]) {
    const lines = [];
    for (let x = Math.ceil(left * 10); x <= right * 10; x += 1) lines.push(this.line([[x / 10, low], [x / 10, high]]));
    for (let y = Math.ceil(low * 10); y <= high * 10; y += 1) lines.push(this.line([[left, y / 10], [right, y / 10]]));
    return svg("path", { class: "grid fine", d: lines.join("") });
  }

  #scaleBar(width, height) {
    const length = SCALES_M.findLast((metres) => metres * this.#scale <= 160) ?? SCALES_M[0];
    const [left, right, y] = [this.px([this.scene.cell.workspace.min_m[0], 0])[0], length * this.#scale, height - 12];
    const end = left + right;
    return svg("g", {},
      svg("path", { class: "scale", d: `M${left} ${y - 4}V${y + 4}M${left} ${y}H${end}M${end} ${y - 4}V${y + 4}` }),
      svg("text", { class: "small", x: end + 7, y: y + 4 }, `${Math.round(length * 1e3)} mm`));
  }
}

/** An arrow head at the end of a line (px). */
export function arrowHead([x, y], heading, length = 12) {
  const wing = (side) => along([x, y], Math.PI - heading + side * 0.42, length);
  return `M${x} ${y}L${wing(1).join(" ")}L${wing(-1).join(" ")}Z`;
}
