/** Opens the page: the link's token becomes a cookie, then the view starts. */

import { CellView } from "/cell/view.js";
import { watch } from "/changes.js";
import { Compare } from "/compare/view.js";
import { byId, html, prose } from "/elements.js";
import { Films } from "/films/view.js";
import { addKeys, startKeys } from "/keys.js";
import { Learned } from "/learned.js";
import { Pile } from "/pile/view.js";
import { RobotView } from "/robot/view.js";
import { ask, read } from "/server.js";

const TOKEN = /^[0-9a-f]{64}$/;
/** Name and title of each view, in the order of the work. */
const VIEWS = [["films", "Films"], ["learned", "Properties"], ["pile", "Pile"], ["compare", "Compare"], ["cell", "Cell"], ["robot", "Robot"]];

/** Exchanges the token behind `#` for a cookie; it leaves the address at once. */
async function open() {
  const token = location.hash.slice(1);
  if (!TOKEN.test(token)) return;
  history.replaceState(null, "", "/");
  await ask("/session", { token }).catch(() => null);
}

/** Time for which a message is shown; an error stays until it is none any more. */
const MESSAGE_MS = 6000;
let hiding = 0;

const message = {
  tell(text) {
    clearTimeout(hiding);
    if (text) hiding = setTimeout(() => message.tell(""), MESSAGE_MS);
    byId("message").replaceChildren(...prose(text));
    byId("message").hidden = !text;
    byId("message").classList.remove("error");
  },
  error(error) {
    message.tell(error.message);
    clearTimeout(hiding);
    byId("message").classList.add("error");
  },
  /** Takes back an error that is no longer one. */
  clear() {
    if (byId("message").classList.contains("error")) message.tell("");
  },
};

/** Shows one view. */
function show(view) {
  document.body.dataset.view = view;
  for (const [name] of VIEWS) {
    byId(name).hidden = name !== view;
    const link = document.querySelector(`nav [href="#/${name}"]`);
    if (name === view) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  document.title = `${VIEWS.find(([name]) => name === view)[1]} \u00b7 breakshot studio`;
  message.tell("");
}

/** A folder without a project gets the offer to begin one. */
function offerToBegin({ cells, objects, campaigns, scenes }) {
  byId("fresh").hidden = [cells, objects, campaigns, scenes].some((names) => names.length);
}

/** The views that this project has something for, and the way from one to another. */
function startViews(contents) {
  const pile = new Pile(message);
  const films = new Films(message);
  const learned = new Learned(message, (clip, where) => {
    location.hash = "/films";
    films.openAt(clip, where).catch(message.error);
  });
  const compare = new Compare(message);
  const cell = new CellView(message);
  const robot = new RobotView(message);
  const views = { films, learned, pile, compare, cell, robot };
  byId("views").replaceChildren(...VIEWS.map(([name, title]) => html("a", { href: `#/${name}` }, title)));
  const started = new Set();
  /** Views that were shown before files were changed. */
  const stale = new Set();
  const renew = async (view) => {
    if (stale.delete(view)) await views[view].refresh(contents).catch(message.error);
  };
  const go = () => {
    const asked = location.hash.slice(2);
    const view = Object.hasOwn(views, asked) ? asked : "pile";
    show(view);
    if (started.has(view)) return renew(view);
    started.add(view);
    return views[view].start(contents).catch(message.error);
  };
  const changed = (now) => {
    // All views hold this one object.
    Object.assign(contents, now);
    offerToBegin(contents);
    started.forEach((view) => stale.add(view));
    return renew(document.body.dataset.view);
  };
  offerToBegin(contents);
  const begin = async () => {
    if (byId("fresh").hidden) return;
    const written = await ask("/api/init", {}).catch(message.error);
    if (!written) return;
    await changed(await read("/api/project"));
    message.tell(`Wrote ${written.join(", ")}. Measure your cell and fill the files in; what you change in them shows up here.`);
  };
  byId("begin").addEventListener("click", begin);
  watch(changed);
  addEventListener("hashchange", go);
  addKeys({ title: "Views" }, [
    ...VIEWS.map(([name, title], k) => [[`Alt+${k + 1}`], title, () => { location.hash = `/${name}`; }]),
    [["Alt+0"], "begin a project in an empty folder", begin],
  ]);
  go();
}

async function start() {
  await open();
  const contents = await read("/api/project").catch(() => null);
  if (!contents) {
    byId("closed").hidden = false;
    return;
  }
  byId("project").textContent = contents.name;
  startKeys();
  startViews(contents);
}

start();
