/** Objects on the table: dragged and turned with the mouse, the pen, a finger or the keys. */

import { degrees, fixed, mm, svg, wrapped } from "/elements.js";
import { addKeys } from "/keys.js";
import { radius } from "/outlines.js";

/** Length of the stalk of the knob that turns an object (px). */
const STALK_PX = 20;
const STEPS_M = { fine: 0.001, coarse: 0.01 };
const STEPS_RAD = { fine: Math.PI / 180, coarse: Math.PI / 12 };

export class Objects {
  #table;
  #pile;
  #groups = new Map();
  #hold = null;

  /** `pile` has `placed`, `poses()`, `selected`, `select(name)`, `move(name, pose)` and `moved()`. */
  constructor(table, pile) {
    this.#table = table;
    this.#pile = pile;
    table.onPointer((event) => this.#drag(event), () => this.#release());
    this.#addKeys();
  }

  /** Draws the objects anew: others have come, or the scale has changed. */
  draw() {
    const focused = document.activeElement?.dataset?.object;
    this.#groups.clear();
    for (const { object: name } of this.#pile.placed) this.#groups.set(name, this.#group(name));
    this.#table.layer("objects").replaceChildren(...this.#groups.values());
    this.update();
    if (focused) this.#groups.get(focused)?.focus();
  }

  /** Puts the drawn objects where they are. */
  update() {
    const poses = this.#pile.poses();
    for (const [name, group] of this.#groups) {
      const pose = poses[name];
      if (!pose) continue;
      const [x, y] = this.#table.px(pose);
      group.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)})`);
      group.firstChild.setAttribute("transform", `rotate(${(-degrees(pose[2])).toFixed(3)})`);
      group.classList.toggle("selected", name === this.#pile.selected && this.#pile.isEditable);
      group.setAttribute("aria-label",
        `object ${name} at x ${mm(pose[0])}, y ${mm(pose[1])} millimetres, turned by ${fixed(degrees(pose[2]))} degrees`);
    }
  }

  #group(name) {
    const shape = this.#table.shape(name);
    const reach = radius(shape) * this.#table.scale;
    const knob = svg("g", { class: "knob" },
      svg("path", { d: `M${reach} 0H${reach + STALK_PX - 5}` }),
      svg("circle", { cx: reach + STALK_PX, cy: 0, r: 5.5 }));
    const turning = svg("g", {},
      svg("path", { class: "current", d: this.#table.outline(shape) }),
      svg("path", { class: "yaw", d: `M${reach * 0.55} 0H${reach * 0.9}` }), knob);
    const group = svg("g", { class: `object ${this.#table.colour(name)}`, tabindex: 0, role: "button", "data-object": name },
      turning, svg("text", { class: "name halo", y: 4.5, "text-anchor": "middle" }, name));
    group.addEventListener("pointerdown", (event) => this.#take(event, name, knob.contains(event.target) || event.shiftKey));
    group.addEventListener("focus", () => this.#pile.select(name));
    return group;
  }

  #take(event, name, isTurning) {
    if (event.button !== 0) return;
    this.#pile.edit();
    const pose = this.#pile.poses()[name];
    const [x, y] = this.#table.point(event);
    this.#hold = { name, isTurning, pointer: event.pointerId, offset: [pose[0] - x, pose[1] - y], yaw: pose[2] };
    this.#hold.angle = Math.atan2(y - pose[1], x - pose[0]);
    this.#table.element.setPointerCapture(event.pointerId);
    this.#pile.select(name);
    this.#groups.get(name)?.focus({ preventScroll: true });
    event.preventDefault();
    event.stopPropagation();
  }

  #drag(event) {
    const hold = this.#hold;
    if (!hold || event.pointerId !== hold.pointer) return;
    const [x, y] = this.#table.point(event);
    const [ox, oy, yaw] = this.#pile.poses()[hold.name];
    if (hold.isTurning) {
      const turned = hold.yaw + Math.atan2(y - oy, x - ox) - hold.angle;
      this.#pile.move(hold.name, [ox, oy, wrapped(turned)]);
    } else {
      this.#pile.move(hold.name, [x + hold.offset[0], y + hold.offset[1], yaw]);
    }
  }

  #release() {
    if (this.#hold) this.#pile.moved();
    this.#hold = null;
  }

  #step(key, act) {
    const name = document.activeElement?.dataset?.object;
    const size = key.includes("Shift+") || "{}".includes(key) ? "coarse" : "fine";
    this.#pile.edit();
    const [x, y, yaw] = this.#pile.poses()[name];
    this.#pile.move(name, act([x, y, yaw], STEPS_M[size], STEPS_RAD[size]), false);
    this.#pile.moved();
  }

  #addKeys() {
    const shift = ([x, y, yaw], dx, dy) => [x + dx, y + dy, yaw];
    const arrows = {
      ArrowLeft: (pose, m) => shift(pose, -m, 0), ArrowRight: (pose, m) => shift(pose, m, 0),
      ArrowUp: (pose, m) => shift(pose, 0, m), ArrowDown: (pose, m) => shift(pose, 0, -m),
    };
    const isObject = (target) => Boolean(target.dataset?.object);
    addKeys({ title: "An object with the focus (Tab goes from one to the next)", view: "pile", isFor: isObject }, [
      [Object.keys(arrows).flatMap((key) => [key, `Shift+${key}`]), "move it by 1 mm, with Shift by 10 mm",
        (key) => this.#step(key, arrows[key.replace("Shift+", "")])],
      [["[", "{"], "turn it to the left by 1\u00b0, with Shift by 15\u00b0", (key) => this.#step(key, ([x, y, yaw], m, rad) => [x, y, wrapped(yaw + rad)])],
      [["]", "}"], "turn it to the right", (key) => this.#step(key, ([x, y, yaw], m, rad) => [x, y, wrapped(yaw - rad)])],
      [["a"], "aim the strike at its centre", () => this.#pile.aimAt(document.activeElement.dataset.object)],
      [["Delete", "Backspace"], "take it off the table", () => this.#pile.remove(document.activeElement.dataset.object)],
    ]);
  }
}
