/** The arm from above and from the side, to one scale. The side view looks across the strike: to the right is its heading. */

import { along, byId, svg } from "/elements.js";
import { outline, placed } from "/outlines.js";
import { arrowHead, kindOf } from "/table.js";

/** Room around everything that moves (m). */
const ROOM_M = 0.06;
const FOOT_PX = 22;
const SCALES_M = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1];

export class Arm {
  #path = null;
  #k = 0;
  #views = [];

  constructor() {
    new ResizeObserver(() => this.#path && this.#draw()).observe(byId("robot-pictures"));
  }

  /** Shows another path. */
  show(path) {
    this.#path = path;
    this.#k = 0;
    this.#draw();
  }

  #draw() {
    const { strike, skeleton_m: skeletons, workspace: { min_m: min, max_m: max } } = this.#path;
    const [cos, sin] = [Math.cos(strike.heading_rad), Math.sin(strike.heading_rad)];
    const corners = [min, [max[0], min[1]], max, [min[0], max[1]]].map(([x, y]) => [x, y, 0]);
    const above = ([x, y]) => [x, y];
    const side = ([x, y, z]) => [x * cos + y * sin, z];
    const all = [...skeletons.flat(), ...corners];
    const width = Math.max(240, byId("robot-above").clientWidth);
    const spans = [above, side].map((flat) => bounds(all.map(flat)));
    // Both drawings have the scale of the wider one.
    const scale = width / Math.max(...spans.map(({ low, high }) => high[0] - low[0]));
    this.#views = [["robot-above", above], ["robot-side", side]].map(([id, flat], k) => this.#view(byId(id), flat, spans[k], scale, width, corners));
    this.at(this.#k);
  }

  #view(element, flat, { low, high }, scale, width, corners) {
    const room = (width - (high[0] - low[0]) * scale) / 2;
    const px = (point) => {
      const [x, y] = flat(point);
      return [room + (x - low[0]) * scale, (high[1] - y) * scale];
    };
    const line = (points) => `M${points.map((point) => px(point).map((v) => v.toFixed(2)).join(" ")).join("L")}`;
    const height = (high[1] - low[1]) * scale + FOOT_PX;
    element.setAttribute("viewBox", `0 0 ${width} ${height.toFixed(1)}`);
    const moving = svg("g", {});
    const isAbove = element.id === "robot-above";
    element.replaceChildren(...(isAbove ? this.#table(line, px, scale, corners) : this.#ground(line, px, width, corners)), this.#tipPath(line), scaleBar(scale, height), moving);
    return { px, line, moving };
  }

  /** The table from above: workspace, objects, and the strike. */
  #table(line, px, scale, corners) {
    const { strike, scene } = this.#path;
    const shapes = new Map((scene?.objects ?? []).map(({ name, shape }) => [name, shape]));
    const kinds = [...shapes.keys()].sort();
    const objects = (scene?.placed ?? []).flatMap(({ object, position_m: at, yaw_rad: yaw }) => {
      const shape = shapes.get(kindOf(object));
      const colour = `c${kinds.indexOf(kindOf(object)) % 8}`;
      const [x, y] = px([...at, 0]);
      return shape ? [svg("path", { class: `current ${colour}`, d: outline(shape, scale), transform: placed([x, y], yaw ?? 0) }), svg("text", { class: "name halo", x, y: y + 4, "text-anchor": "middle" }, object)] : [];
    });
    const tip = along(strike.start_m, strike.heading_rad, strike.travel_m);
    return [
      svg("path", { class: "workspace", d: `${line(corners)}Z` }), ...objects,
      svg("path", { class: "strike", d: line([[...strike.start_m, 0], [...tip, 0]]) }),
      svg("path", { class: "strike-head", d: arrowHead(px([...tip, 0]), strike.heading_rad) }),
    ];
  }

  /** The table from the side: a line, wider where the workspace is. */
  #ground(line, px, width, corners) {
    const y = px([0, 0, 0])[1];
    const xs = corners.map((corner) => px(corner)[0]);
    return [
      svg("path", { class: "zero", d: `M0 ${y}H${width}` }),
      svg("path", { class: "wall", d: `M${Math.min(...xs)} ${y + 2}H${Math.max(...xs)}` }),
      svg("text", { class: "small", x: Math.min(...xs) + 4, y: y + 17 }, "table"),
    ];
  }

  #tipPath(line) {
    return svg("path", { class: "tip-path", d: line(this.#path.skeleton_m.map((skeleton) => skeleton.at(-1))) });
  }

  /** Shows the arm at sample `k`. */
  at(k) {
    this.#k = k;
    const skeleton = this.#path.skeleton_m[k];
    for (const { px, line, moving } of this.#views) {
      const joints = skeleton.slice(0, -2).map((point) => {
        const [cx, cy] = px(point);
        return svg("circle", { class: "arm-joint", cx, cy, r: 4.5 });
      });
      const [cx, cy] = px(skeleton.at(-1));
      moving.replaceChildren(svg("path", { class: "arm-ground", d: line(skeleton) }), svg("path", { class: "arm", d: line(skeleton.slice(0, -1)) }), svg("path", { class: "arm-tool", d: line(skeleton.slice(-2)) }), ...joints, svg("circle", { class: "arm-tip", cx, cy, r: 4 }));
    }
  }
}

function bounds(points) {
  const low = [0, 1].map((k) => Math.min(...points.map((p) => p[k])) - ROOM_M);
  const high = [0, 1].map((k) => Math.max(...points.map((p) => p[k])) + ROOM_M);
  return { low, high };
}

function scaleBar(scale, height) {
  const length = SCALES_M.findLast((metres) => metres * scale <= 110) ?? SCALES_M[0];
  const [y, end] = [height - 9, 8 + length * scale];
  return svg("g", {}, svg("path", { class: "scale", d: `M8 ${y - 4}V${y + 4}M8 ${y}H${end}M${end} ${y - 4}V${y + 4}` }), svg("text", { class: "small", x: end + 7, y: y + 4 }, `${Math.round(length * 1e3)} mm`));
}
