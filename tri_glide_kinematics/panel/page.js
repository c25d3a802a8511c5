// Lies above viser's page: the strip with the state, Stop, and buttons that act while they are held.
// It is run anew at each connection, and begins by removing what an earlier run has left.
"use strict";
const settings = SETTINGS;
if (window.triGlide) window.triGlide.remove();

const viser = () => window.__viserMutable;
const press = (uuid) => viser().sendMessage({ type: "GuiUpdateMessage", uuid, updates: { value: true } });
const listening = new AbortController();
const on = (target, name, call, options = {}) =>
  target.addEventListener(name, call, { ...options, signal: listening.signal });

const style = document.createElement("style");
style.textContent = settings.css;
document.head.append(style);

const strip = document.createElement("div");
strip.id = "tri-glide-strip";
strip.innerHTML =
  '<div class="head"><div class="state" role="status"></div>' +
  '<button type="button" class="more" aria-expanded="false">messages</button>' +
  '<div class="motion"><span class="position"></span><span class="speed"></span><span class="left"></span></div></div>' +
  '<div class="words"><div class="reason"></div><div class="refusal" role="alert"></div><div class="pages"></div></div>' +
  '<ol class="history" hidden></ol>';
const stop = document.createElement("button");
stop.id = "tri-glide-stop";
stop.type = "button";
stop.innerHTML = "STOP<small></small>";
document.body.append(strip, stop);

// On the press, not on the release: every moment counts.
let stopped = 0;
const sendStop = () => {
  stopped += 1;
  release();
  press(settings.stop);
};
on(stop, "pointerdown", sendStop);
// Of a keyboard or a screen reader, which press nothing.
on(stop, "click", (event) => { if (event.detail === 0) sendStop(); });
on(window, "keydown", (event) => { if (event.key === "Escape") sendStop(); }, { capture: true });

// A button with data-hold renews what it does, and says when it is released.
let held = null;
const release = () => {
  if (held === null) return;
  clearInterval(held.timer);
  held.button.classList.remove("held");
  held = null;
  press(settings.release);
};
const hold = (event) => {
  const button = event.target.closest?.("[data-hold]");
  if (!button || event.button !== 0 || !event.isPrimary) return;
  release();
  try { button.setPointerCapture(event.pointerId); } catch { /* it is gone already */ }
  const send = () => viser().sendMessage(
    { type: "GuiButtonHoldMessage", uuid: button.dataset.hold, frequency: settings.renewals });
  held = { button, timer: setInterval(send, 1000 / settings.renewals) };
  button.classList.add("held");
  send();
};
on(document, "pointerdown", hold);
for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) on(document, name, release);
on(document, "contextmenu", (event) => { if (event.target.closest?.("[data-hold]")) event.preventDefault(); });
on(window, "blur", release);
on(window, "pagehide", release);
on(document, "visibilitychange", () => { if (document.hidden) release(); else heard = performance.now(); });

// A button with data-press acts once.
on(document, "click", (event) => {
  const button = event.target.closest?.("[data-press]");
  if (button) press(button.dataset.press);
});

// A file goes in pieces, of which the panel asks for a few at a time: Stop never waits behind a file.
let file = null;
on(document, "change", (event) => {
  const input = event.target.closest?.("[data-upload]");
  const chosen = input?.files[0];
  if (!chosen) return;
  file = { chosen, key: String(Math.random()), sent: 0, asked: 0 };
  viser().sendMessage({
    type: "FileTransferStartUpload", source_component_uuid: "", transfer_uuid: file.key, filename: chosen.name,
    mime_type: "", part_count: Math.ceil(chosen.size / settings.piece), size_bytes: chosen.size,
  });
  // So that the same file may be chosen again.
  input.value = "";
});
const sendPieces = async (key, asked) => {
  const mine = file;
  if (mine?.key !== key) return;
  const isSending = mine.sent < mine.asked;
  mine.asked = Math.min(asked, Math.ceil(mine.chosen.size / settings.piece));
  if (isSending) return;
  while (mine === file && mine.sent < mine.asked) {
    let content = null;
    const begin = mine.sent * settings.piece;
    // A file that has changed or gone meanwhile cannot be read: the panel is told by a piece without bytes.
    try { content = new Uint8Array(await mine.chosen.slice(begin, begin + settings.piece).arrayBuffer()); }
    catch { file = null; }
    viser().sendMessage({
      type: "FileTransferPart", source_component_uuid: "", transfer_uuid: key, part_index: mine.sent,
      content: content ?? new Uint8Array(0),
    });
    mine.sent += 1;
  }
};

// What was told before, the newest first.
const list = strip.querySelector(".history");
const more = strip.querySelector(".more");
on(more, "click", () => {
  list.hidden = !list.hidden;
  more.setAttribute("aria-expanded", String(!list.hidden));
});
const history = (entries) => {
  list.replaceChildren(...entries.map(({ time, color, text, log, count }) => {
    const item = document.createElement("li");
    item.dataset.color = color;
    const add = (name, words) => {
      const part = document.createElement("span");
      part.className = name;
      part.textContent = words;
      item.append(part);
    };
    add("time", time);
    add("text", count > 1 ? `${text} (${count} times)` : text);
    if (log) add("log", `log, in m: ${log}`);
    return item;
  }));
};

let hasControls = false;
let heard = performance.now();
const show = (told) => {
  heard = performance.now();
  strip.dataset.color = told.color;
  hasControls = told.controls;
  for (const name of ["state", "position", "speed", "left", "reason", "refusal", "pages"]) {
    const place = strip.querySelector("." + name);
    if (place.textContent !== told[name]) place.textContent = told[name];
  }
  stop.querySelector("small").textContent = told.stop;
  document.body.classList.remove("tri-glide-lost");
};
const look = setInterval(() => {
  // The canvas ends where viser's own panel begins.
  const canvas = document.querySelector("canvas");
  if (canvas) document.documentElement.style.setProperty("--strip-width", canvas.clientWidth + "px");
  if (document.hidden || performance.now() - heard < settings.silence) return;
  document.body.classList.add("tri-glide-lost");
  strip.dataset.color = "fault";
  strip.querySelector(".state").textContent = "no connection";
  for (const name of ["position", "speed", "left"]) strip.querySelector("." + name).textContent = "";
  hasControls = false;
  strip.querySelector(".reason").textContent = "The panel does not answer: what is shown is old, and nothing can be sent.";
  stop.querySelector("small").textContent = "no connection: use the emergency stop";
}, 250);

window.triGlide = {
  show,
  sendPieces,
  history,
  get stopped() { return stopped; },
  remove: () => {
    listening.abort();
    clearInterval(look);
    if (held) clearInterval(held.timer);
    for (const each of [style, strip, stop]) each.remove();
  },
};
