/** Where the objects of a clip are in its first frame: dragged and turned with the mouse or the keys, and written into the campaign. */

import { byId, degrees, fixed, html, mm, svg, wrapped } from "/elements.js";
import { addKeys } from "/keys.js";
import { Newest, ask, read } from "/server.js";

const STEPS_M = { fine: 0.001, coarse: 0.01 };
const STEPS_RAD = { fine: Math.PI / 180, coarse: Math.PI / 12 };
/** Rest after which a start that was moved with the keys is written (ms). */
const REST_MS = 500;
/** Length of the stalk of the knob that turns an object, as a part of the distance from its centre to its rim. */
const STALK = 1.35;

const ring = (points) => `M${points.map((p) => p.map((v) => v.toFixed(2)).join(" ")).join("L")}Z`;

export class Starts {
  #message;
  #films;
  #seen = [];
  #clip = null;
  #hold = null;
  #rest = 0;

  /** `films` has `campaign`, `clip`, `clipNumber`, `colour(name)`, `toFirst()`, `save(change)` and `redraw()`. */
  constructor(message, films) {
    this.#message = message;
    this.#films = films;
    this.asking = new Newest((question) => ask("/api/start", question), (seen) => this.#moved(seen), message.error);
    byId("correct").addEventListener("click", () => this.toggle());
    const layer = byId("starts");
    layer.addEventListener("pointerdown", (event) => this.#take(event));
    layer.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel"]) layer.addEventListener(end, () => this.#release());
    this.#addKeys();
  }

  /** Whether starts are corrected now. */
  get isOn() {
    return this.#clip !== null;
  }

  /** Shows the objects of the clip in its first frame, or leaves that. */
  async toggle() {
    if (this.isOn) return this.off();
    if (!this.#films.clip?.is_film) return null;
    this.#clip = this.#films.clip.name;
    this.#films.toFirst();
    await this.#read().catch((error) => {
      this.off();
      this.#message.error(error);
    });
    byId("starts").querySelector("g")?.focus();
    return null;
  }

  /** Leaves the correction. */
  off() {
    if (!this.isOn) return;
    const hadFocus = byId("starts").contains(document.activeElement);
    this.#clip = null;
    this.#seen = [];
    this.#state();
    if (hadFocus) byId("correct").focus();
  }

  /** Another clip is open, or the campaign was changed. */
  show() {
    const { clip } = this.#films;
    const given = (clip?.starts ?? []).map(({ object, position_m: [x, y] }) => html("li", {}, `${object} begins at ${mm(x)}, ${mm(y)} mm`,
      html("button", { type: "button", class: "icon", "aria-label": `find ${object} without a given start`, onclick: () => this.#remove(object) }, "\u00d7")));
    byId("given-starts").replaceChildren(...given);
    byId("correct").disabled = !clip?.is_film || clip.is_excluded;
    if (!this.isOn) return;
    if (clip?.name === this.#clip && !clip.is_excluded) this.#read().catch(this.#message.error);
    else this.off();
  }

  async #read() {
    const seen = await read("/api/starts", { campaign: this.#films.campaign, clip: this.#films.clipNumber });
    if (!this.isOn || this.#hold || this.#rest) return;
    this.#seen = seen;
    this.#state();
  }

  #state() {
    byId("starts").toggleAttribute("hidden", !this.isOn);
    byId("correct").setAttribute("aria-pressed", String(this.isOn));
    byId("correct-words").hidden = !this.isOn;
    this.#draw();
    this.#films.redraw();
  }

  #draw() {
    const focused = document.activeElement?.closest?.("[data-start]")?.dataset.start;
    byId("starts").replaceChildren(...this.#seen.map((one) => this.#group(one)));
    if (focused) byId("starts").querySelector(`[data-start="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
  }

  #group({ object, position_m: [x, y], yaw_rad: yaw, turns, is_given: isGiven, center_px: [u, v], ahead_px: [p, q], outline_px: outline }) {
    const knob = [u + STALK * (p - u), v + STALK * (q - v)];
    const turning = turns ? [svg("path", { class: "stalk", d: `M${u} ${v}L${knob.join(" ")}` }), svg("circle", { class: "knob", cx: knob[0], cy: knob[1], r: 13 })] : [];
    const words = `${object}${isGiven ? " begins here" : ""}`;
    const label = `object ${object} at x ${mm(x)}, y ${mm(y)} millimetres${turns ? `, turned by ${fixed(degrees(yaw))} degrees` : ""}${isGiven ? ", given" : ", not given"}`;
    return svg("g", { class: `start ${this.#films.colour(object)} ${isGiven ? "given" : ""}`, tabindex: 0, role: "button", "data-start": object, "aria-label": label },
      svg("path", { class: "start-ground", d: ring(outline) }), svg("path", { class: "start-outline", d: ring(outline) }),
      svg("path", { class: "start-center", d: `M${u - 12} ${v}H${u + 12}M${u} ${v - 12}V${v + 12}` }), ...turning,
      svg("text", { class: "found-name", x: u, y: Math.min(...outline.map((point) => point[1])) - 12, "text-anchor": "middle" }, words));
  }

  #question(object, place, yaw) {
    this.asking.want({ campaign: this.#films.campaign, clip: String(this.#films.clipNumber), object, yaw_rad: yaw, ...place });
  }

  #moved(seen) {
    const k = this.#seen.findIndex(({ object }) => object === seen.object);
    if (k < 0 || !this.isOn) return;
    this.#seen[k] = seen;
    this.#draw();
  }

  #place(event) {
    const layer = byId("starts");
    const box = layer.getBoundingClientRect();
    const ratio = layer.viewBox.baseVal.width / box.width;
    return [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
  }

  #take(event) {
    const group = event.target.closest?.("[data-start]");
    if (!group || event.button !== 0) return;
    const seen = this.#seen.find(({ object }) => object === group.dataset.start);
    const [x, y] = this.#place(event);
    const [u, v] = seen.center_px;
    const isTurning = seen.turns && (event.shiftKey || event.target.matches(".knob"));
    this.#hold = { object: seen.object, isTurning, isMoved: false, offset: [u - x, v - y], angle: Math.atan2(y - v, x - u), yaw: seen.yaw_rad };
    byId("starts").setPointerCapture(event.pointerId);
    group.focus({ preventScroll: true });
    event.preventDefault();
  }

  #drag(event) {
    const hold = this.#hold;
    if (!hold) return;
    const seen = this.#seen.find(({ object }) => object === hold.object);
    const [x, y] = this.#place(event);
    hold.isMoved = true;
    if (hold.isTurning) {
      // The camera looks from above: what turns to the left on the table turns to the left in the picture, whose y axis points down.
      const [u, v] = seen.center_px;
      this.#question(hold.object, { position_m: seen.position_m }, wrapped(hold.yaw - (Math.atan2(y - v, x - u) - hold.angle)));
    } else this.#question(hold.object, { pixel: [x + hold.offset[0], y + hold.offset[1]] }, hold.yaw);
  }

  #release() {
    const hold = this.#hold;
    this.#hold = null;
    if (hold?.isMoved) this.#writeSoon();
  }

  #step(event, change) {
    const object = event.target.closest("[data-start]").dataset.start;
    const seen = this.#seen.find((one) => one.object === object);
    const isCoarse = event.shiftKey;
    const [position, yaw] = change(seen, isCoarse ? STEPS_M.coarse : STEPS_M.fine, isCoarse ? STEPS_RAD.coarse : STEPS_RAD.fine);
    // The next key counts from here, before the answer has come.
    [seen.position_m, seen.yaw_rad] = [position, yaw];
    this.#question(object, { position_m: position }, yaw);
    this.#writeSoon();
  }

  /** Writes the starts when nothing has been moved for a moment. */
  #writeSoon() {
    clearTimeout(this.#rest);
    this.#rest = setTimeout(() => {
      this.#rest = 0;
      if (this.isOn && !this.#hold) this.#write(this.#seen.filter(({ is_given: isGiven }) => isGiven));
    }, REST_MS);
  }

  #write(seen) {
    const entry = ({ object, position_m: position, yaw_rad: yaw, turns }) => ({ object, position_m: position, ...(turns ? { yaw_rad: yaw } : {}) });
    this.#films.save({ starts: seen.map(entry) });
  }

  #remove(object) {
    const others = this.#films.clip.starts.filter((start) => start.object !== object);
    this.#films.save({ starts: others });
  }

  #addKeys() {
    const isStart = (target) => Boolean(target.closest?.("[data-start]"));
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const move = (key, event) => this.#step(event, ({ position_m: [x, y], yaw_rad: yaw }, m) => {
      const [dx, dy] = moves[key.replace("Shift+", "")];
      return [[x + dx * m, y + dy * m], yaw];
    });
    const turn = (sign) => (_, event) => this.#step(event, ({ position_m: position, yaw_rad: yaw }, m, rad) => [position, wrapped(yaw + sign * rad)]);
    addKeys({ title: "An object whose start is corrected (Tab goes from one to the next)", view: "films", isFor: isStart }, [
      [Object.keys(moves).flatMap((key) => [key, `Shift+${key}`]), "move it by 1 mm on the table, with Shift by 10 mm", move],
      [["[", "{"], "turn it to the left by 1\u00b0, with Shift by 15\u00b0", turn(1)],
      [["]", "}"], "turn it to the right", turn(-1)],
      [["Delete", "Backspace"], "find it without a given start", (_, event) => this.#remove(event.target.closest("[data-start]").dataset.start)],
      [["Escape"], "done", () => this.off()],
    ]);
    addKeys({ title: "Starts", view: "films", isFor: (target) => !target.matches("select, input[type=text]") }, [
      [["c"], "correct where the objects begin, or leave that", () => this.toggle()],
    ]);
  }
}
