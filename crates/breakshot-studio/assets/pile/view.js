/** The pile: objects, a strike, its motion, and where everything may come to rest. */

import { along, byId, degrees, distance, fillSelect, html, setField, showNothing } from "/elements.js";
import { addKeys } from "/keys.js";
import { path, pose } from "/motion.js";
import { Areas } from "/pile/areas.js";
import { Objects } from "/pile/drag.js";
import { showForecast, showProblem } from "/pile/forecast.js";
import { Goal } from "/pile/goal.js";
import { StrikeMap } from "/pile/map.js";
import { NEW, askForNew, startNew } from "/pile/new.js";
import { ObjectList } from "/pile/objects.js";
import { FromPicture } from "/pile/picture.js";
import { Planner } from "/pile/plan.js";
import { Player } from "/pile/player.js";
import { StrikeHandles, written } from "/pile/strike.js";
import { Newest, ask, read } from "/server.js";
import { Table, kindOf } from "/table.js";

/** Worlds of the cloud while something is dragged, and at rest: those of a plan. */
const WORLDS = { dragged: 60, atRest: 400 };
/** Rest after which the cloud is computed with all worlds (ms). */
const REST_MS = 250;
/** Follow-through and speed, as a part of the fastest, of a strike that is aimed by the page. */
const AIM = { follow_through_m: 0.01, speed: 0.7 };
const AIMED = "aimed";
const DRAWN = "";

export class Pile {
  placed = [];
  strike = null;
  selected = null;
  #goal = null;
  #motion = null;
  #outlook = null;
  #isDirty = false;
  #isStarted = false;
  #hasAsked = false;
  /** The scene as it is in its file, as text. */
  #written = "";
  #rest = 0;
  #isAtRest = false;
  #message;

  constructor(message) {
    this.#message = message;
    this.table = new Table(byId("ground"), byId("table"));
    this.areas = new Areas(this.table, this);
    this.objects = new Objects(this.table, this);
    this.handles = new StrikeHandles(this.table, this);
    this.player = new Player(() => this.#showTime());
    this.list = new ObjectList(this);
    this.goal = new Goal((goal) => this.#setGoal(goal));
    this.planner = new Planner(this, message);
    this.map = new StrikeMap(this, message);
    this.picture = new FromPicture(this, message);
    this.#askers();
    this.#listen();
  }

  #askers() {
    this.settle = new Newest((q) => ask("/api/settle", q), ({ pose: found }, { object }) => this.#put(object, found), this.#message.error);
    this.motion = new Newest((q) => ask("/api/motion", q), (motion, question) => this.#moves(motion, question), (error) => this.#failed(error));
    this.cloud = new Newest((q) => ask("/api/cloud", q), (outlook) => this.#showCloud(outlook), () => this.#showCloud(null));
  }

  #listen() {
    byId("scene").addEventListener("change", (event) => {
      if (event.target.value === NEW) askForNew(this.contents);
      else this.open(event.target.value).catch(this.#message.error);
    });
    byId("properties").addEventListener("change", () => this.changed());
    byId("strike-source").addEventListener("change", (event) => this.#openStrike(event.target.value).catch(this.#message.error));
    byId("save").addEventListener("click", () => this.save());
    byId("save-strike").addEventListener("click", () => this.saveStrike());
    byId("export").addEventListener("click", () => this.export());
    document.addEventListener("learned", () => this.contents && this.#showProperties());
    for (const id of ["heading", "speed", "travel", "start-x", "start-y"]) {
      byId(id).addEventListener("input", (event) => this.#fieldsChanged(event.target));
      byId(id).addEventListener("blur", (event) => delete event.target.dataset.edited);
    }
    new ResizeObserver(() => this.table.scene && this.#drawAll()).observe(byId("table"));
    addKeys({ title: "The pile", view: "pile" }, [
      [["Ctrl+s"], "save the scene", () => this.save()],
      [["Ctrl+S"], "save the strike", () => this.saveStrike()],
      [["x"], "export the pile and the strike as a model of MuJoCo", () => this.export()],
      [["n"], "add an object", () => this.list.add()],
    ]);
  }

  /** Shows the files of a project, and its first scene. */
  async start(contents) {
    this.contents = contents;
    this.#showScenes(contents.scenes[0]);
    this.picture.show();
    if (!this.#isStarted) startNew(contents, this.#message, (file) => this.created(file).catch(this.#message.error));
    this.#isStarted = true;
    this.#showProperties();
    if (contents.scenes.length) await this.open(contents.scenes[0]);
    else if (contents.cells.length && contents.objects.length) this.#askOnce();
    else showNothing("pile", "This folder holds no scene, and no cell and objects to make one of. ", html("code", {}, "breakshot init"), " writes templates, ", html("code", {}, "breakshot look"), " takes a scene from a picture.");
  }

  /** Asks for a first pile; not again with every file that is written. */
  #askOnce() {
    byId("pile").classList.remove("empty");
    if (!this.#hasAsked) askForNew(this.contents);
    this.#hasAsked = true;
  }

  /** The files of properties; what was chosen stays so. */
  #showProperties() {
    fillSelect(byId("properties"), this.contents.properties.map((name) => [name, name]), byId("properties").value);
    if (this.scene) this.changed();
  }

  /** Files were changed: lists and properties are shown anew, and the scene if it is another one and nothing on the table is unsaved. */
  async refresh() {
    if (!this.scene) return this.start(this.contents);
    if (!this.contents.scenes.includes(this.file)) return this.#removed();
    this.#showScenes(this.file);
    this.picture.show();
    this.#showStrikes(byId("strike-source").value);
    this.#showProperties();
    const { scene } = await read("/api/scene", { file: this.file });
    if (JSON.stringify(scene) === this.#written) return null;
    this.#written = JSON.stringify(scene);
    if (this.#isDirty) return this.#message.error(new Error(`${this.file} was changed by another program; saving replaces that.`));
    await this.open(this.file);
    return this.#message.tell(`${this.file} was changed by another program and is shown anew.`);
  }

  /** The file of the scene was removed by another program: another scene is shown, or none. */
  async #removed() {
    const gone = this.file;
    Object.assign(this, { placed: [], strike: null, selected: null });
    Object.assign(this.scene, { walls: [], keep_out: [] });
    this.#drawAll();
    this.motion.drop();
    this.changed();
    this.list.showKinds([]);
    this.scene = this.table.scene = this.file = null;
    await this.start(this.contents);
    this.#message.error(new Error(`${gone} was removed by another program.`));
  }

  #showScenes(chosen) {
    const { scenes, cells, objects } = this.contents;
    const more = cells.length && objects.length ? [NEW] : [];
    const none = scenes.length ? [] : [["", "none"]];
    fillSelect(byId("scene"), [...none, ...[...scenes, ...more].map((name) => [name, name])], chosen);
  }

  /** A new scene was written, or none. */
  async created(file) {
    if (file) this.contents.scenes = [...new Set([...this.contents.scenes, file])].sort();
    this.#showScenes(file ?? this.file ?? "");
    if (!file) return;
    await this.open(file);
    this.#message.tell(`Wrote ${file}. Add objects to it.`);
  }

  /** Opens a scene file. */
  async open(file) {
    const { scene, notes } = await read("/api/scene", { file });
    this.file = file;
    this.placed = scene.placed;
    this.#goal = scene.goal;
    this.scene = scene;
    this.#written = JSON.stringify(scene);
    byId("pile").classList.remove("empty");
    [this.selected, this.#motion, this.#outlook, this.#isDirty] = [null, null, null, false];
    this.goal.show(scene.goal);
    this.list.showKinds(scene.objects);
    this.#drawAll();
    this.#message.tell(notes.join(" "));
    this.#showStrikes(DRAWN);
    this.strike = null;
    this.map.clear();
    if (this.placed.length) await this.#openStrike(`${AIMED} ${this.placed[0].object}`);
    else this.changed();
    this.handles.draw();
    this.#tellSaved();
  }

  #showStrikes(chosen) {
    const files = [...this.contents.plans, ...this.contents.strikes];
    fillSelect(byId("strike-source"), [[DRAWN, "as drawn"], ...this.placed.map(({ object }) => [`${AIMED} ${object}`, `aimed at ${object}`]), ...files.map((name) => [name, name])], chosen);
  }

  /** The pile as the server is asked about it. */
  request() {
    return { scene: this.file, placed: this.placed, walls: this.scene.walls, keep_out: this.scene.keep_out, goal: this.#goal };
  }

  /** Whether what is on the table can be taken: it is the pile before the strike. */
  get isEditable() {
    return this.player.time === 0 && !this.player.isPlaying;
  }

  /** Shows the pile before the strike, so that it can be changed. */
  edit() {
    if (this.isEditable) return;
    this.player.pause();
    this.player.go(0);
  }

  /** The poses at the instant that is shown. */
  poses() {
    const time = this.player?.time ?? 0;
    const at = ({ object, position_m: [x, y], yaw_rad }) => (time > 0 && this.#motion && pose(this.#motion.trajectory, object, time)) || [x, y, yaw_rad];
    return Object.fromEntries(this.placed.map((placed) => [placed.object, at(placed)]));
  }

  /** The pose of the striker while it moves; null before. */
  strikerPose() {
    const time = this.player.time;
    return time > 0 && this.#motion ? pose(this.#motion.trajectory, "striker", time) : null;
  }

  /** The centre of the striker at its first impact; null for a strike that misses. */
  contact() {
    const first = this.#motion?.trajectory.events.find((event) => event.bodies.includes("striker"));
    return first ? first.point_m : null;
  }

  select(name) {
    this.selected = name;
    this.objects.update();
    this.list.select(name);
  }

  /** Asks for an object to be moved; the server finds the nearest free pose. */
  move(object, to, snap = true) {
    this.settle.want({ pile: this.request(), object, to, snap });
  }

  #put(object, [x, y, yaw]) {
    const placed = this.placed.find((one) => one.object === object);
    if (!placed) return;
    placed.position_m = [x, y].map((v) => Number(v.toFixed(7)));
    placed.yaw_rad = Number(yaw.toFixed(6));
    this.touch();
  }

  /** The pile was changed. */
  touch() {
    this.#message.clear();
    this.#isDirty = true;
    this.#tellSaved();
    this.map.clear();
    this.objects.update();
    this.list.update();
    this.changed();
  }

  /** Objects were added or removed. */
  replaced() {
    if (!this.strike && this.placed.length) this.aimAt(this.placed[0].object).catch(this.#message.error);
    this.objects.draw();
    this.list.draw();
    this.touch();
  }

  /** Walls or keep-out areas were changed. */
  surroundingsChanged() {
    this.#drawAll();
    this.touch();
  }

  remove(object) {
    this.placed = this.placed.filter((placed) => placed.object !== object);
    if (this.selected === object) this.selected = null;
    this.replaced();
  }

  #setGoal(goal) {
    this.#goal = goal;
    this.touch();
  }

  get currentGoal() {
    return this.#goal;
  }

  /** Shows another strike. */
  setStrike(strike, source = DRAWN) {
    this.#message.clear();
    this.strike = strike;
    byId("strike-source").value = source;
    this.handles.draw();
    this.#showFields();
    this.changed();
  }

  /** Something was dropped. */
  moved() {
    this.changed();
  }

  /** Asks for the motion and the cloud of what is shown. */
  changed() {
    const properties = byId("properties").value;
    clearTimeout(this.#rest);
    if (!this.strike || !properties || !this.placed.length) {
      this.#failed(new Error(properties ? "Add objects to the table." : "Choose properties to see the motion: `breakshot estimate` writes them."));
      return;
    }
    const question = { pile: this.request(), properties, strike: this.strike };
    this.#isAtRest = false;
    this.motion.want(question);
    this.#rest = setTimeout(() => {
      this.#isAtRest = true;
      this.cloud.want({ ...question, worlds: WORLDS.atRest });
    }, REST_MS);
  }

  async aimAt(object) {
    const heading = this.#headingToOthers(object);
    const range = this.scene.cell.striker.speed_range_m_s;
    const turns = [0, 0.3, -0.3, 0.6, -0.6, 1, -1, 1.6, -1.6, 2.4, -2.4, Math.PI];
    let obstacle = null;
    for (const turn of turns) {
      const aim = { object, heading_rad: heading + turn, offset_m: 0, speed_m_s: AIM.speed * range[1], follow_through_m: AIM.follow_through_m };
      const answer = await ask("/api/aim", { pile: this.request(), aim });
      if (answer.strike) return this.setStrike(written(answer.strike), `${AIMED} ${object}`);
      obstacle = answer.obstacle;
    }
    this.setStrike(this.#fallback(object, heading));
    return this.#message.error(new Error(`No free line to ${object}: ${obstacle} is in the way.`));
  }

  #headingToOthers(object) {
    const own = this.placed.find((placed) => placed.object === object).position_m;
    const sum = this.placed.reduce(([x, y], { position_m: [u, v] }) => [x + u - own[0], y + v - own[1]], [0, 0]);
    return Math.atan2(sum[1], sum[0]);
  }

  #fallback(object, heading) {
    const own = this.placed.find((placed) => placed.object === object).position_m;
    return written({ object, start_m: along(own, heading + Math.PI, 0.12), heading_rad: heading, speed_m_s: 0.5, travel_m: 0.08 });
  }

  async #openStrike(source) {
    if (source.startsWith(`${AIMED} `)) return this.aimAt(source.slice(AIMED.length + 1));
    if (source === DRAWN) return null;
    return this.setStrike(await read("/api/strike", { file: source }), source);
  }

  #fieldsChanged(field) {
    if (!this.strike) return;
    field.dataset.edited = "true";
    const value = (id, scale) => Number(byId(id).value) * scale;
    const strike = {
      ...this.strike,
      start_m: [value("start-x", 1e-3), value("start-y", 1e-3)],
      heading_rad: (value("heading", 1) * Math.PI) / 180,
      speed_m_s: value("speed", 1),
      travel_m: value("travel", 1e-3),
    };
    if (Object.values(strike).flat().some(Number.isNaN) || strike.speed_m_s <= 0 || strike.travel_m <= 0) return;
    this.edit();
    this.setStrike(written(strike));
  }

  #showFields() {
    const { start_m: [x, y], heading_rad, speed_m_s, travel_m } = this.strike;
    const values = { heading: [degrees(heading_rad), 1], speed: [speed_m_s, 3], travel: [travel_m * 1e3, 1], "start-x": [x * 1e3, 1], "start-y": [y * 1e3, 1] };
    for (const [id, [value, decimals]] of Object.entries(values)) setField(byId(id), value, decimals);
  }

  #drawAll() {
    this.table.show(this.scene);
    this.areas.draw();
    this.objects.draw();
    this.list.draw();
    this.handles.draw();
    this.map.draw();
    this.picture.draw();
    if (this.#motion) this.#showMotion(this.#motion);
    if (this.#outlook) this.#showCloud(this.#outlook);
  }

  /** A motion has come: it is shown, and the cloud is asked for. One after the other they do not wait for the same cores. */
  #moves(motion, question) {
    // A motion that took long comes when all worlds have been asked for.
    this.cloud.want({ ...question, worlds: this.#isAtRest ? WORLDS.atRest : WORLDS.dragged });
    this.#showMotion(motion);
  }

  #showMotion(motion) {
    this.#motion = motion;
    const names = [...Object.keys(motion.trajectory.final)];
    const paths = Object.fromEntries(names.map((name) => [name, path(motion.trajectory, name)]));
    this.table.showExpected(paths, motion.trajectory.final);
    this.table.element.classList.remove("impossible");
    this.player.show(motion.trajectory);
    showForecast({ motion });
  }

  #showCloud(outlook) {
    this.#outlook = outlook;
    this.table.showCloud(outlook?.cloud);
    showForecast({ outlook });
  }

  #failed(error) {
    [this.#motion, this.#outlook] = [null, null];
    this.cloud.drop();
    this.table.showExpected({}, {});
    this.table.showCloud(null);
    this.table.element.classList.add("impossible");
    this.player.show(null);
    showProblem(error.message);
  }

  #showTime() {
    this.table.element.classList.toggle("in-motion", this.player.time > 0);
    this.objects.update();
    this.handles.update();
  }

  #tellSaved() {
    byId("save").disabled = !this.#isDirty;
  }

  async save() {
    if (!this.scene) return;
    try {
      const file = await ask("/api/save", { pile: this.request() });
      this.#isDirty = false;
      this.#tellSaved();
      this.#written = JSON.stringify((await read("/api/scene", { file })).scene);
      this.picture.renew();
      this.#message.tell(`Wrote ${file}.`);
    } catch (error) {
      this.#message.error(error);
    }
  }

  /** The name of a file that belongs to the scene. */
  #besides(ending) {
    return this.file.replace(/(\.scene)?\.toml$/, ending);
  }

  async saveStrike() {
    if (!this.strike) return;
    const file = await ask("/api/strike", { strike: this.strike, output: this.#besides(".strike.json") }).catch(this.#message.error);
    if (file) this.#message.tell(`Wrote ${file}.`);
  }

  /** Writes the pile and the strike for another simulator. */
  async export() {
    if (!this.strike) return;
    const question = { pile: this.request(), properties: byId("properties").value, strike: this.strike, output: this.#besides(".xml") };
    const written = await ask("/api/export", question).catch(this.#message.error);
    if (written) this.#message.tell([`Wrote ${written.file}.`, ...written.notes].join(" "));
  }

  /** A name for another object of a kind, and a free place for it. */
  newName(kind) {
    const copies = this.placed.filter(({ object }) => kindOf(object) === kind).map(({ object }) => object);
    if (!copies.includes(kind)) return kind;
    for (let k = 2; ; k += 1) if (!copies.includes(`${kind}#${k}`)) return `${kind}#${k}`;
  }

  /** The point of the workspace that is farthest from all objects. */
  freePlace() {
    const { min_m: low, max_m: high } = this.scene.cell.workspace;
    const points = Array.from({ length: 99 }, (_, k) => [low[0] + ((high[0] - low[0]) * ((k % 11) + 1)) / 12, low[1] + ((high[1] - low[1]) * (Math.floor(k / 11) + 1)) / 10]);
    const room = (point) => Math.min(1, ...this.placed.map(({ position_m }) => distance(point, position_m)));
    return points.reduce((best, point) => (room(point) > room(best) ? point : best));
  }
}
