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

// viser forgets what it sends of fields and buttons within 50 ms of another one, but for the newest: of a number that is
// typed before Go, some digits. Here nothing is held back: its timer after such a message is over at once.
const { sendMessage } = viser(), { setTimeout } = window;
let isInput = false;
viser().sendMessage = (message) => {
  isInput = message.type === "GuiUpdateMessage";
  queueMicrotask(() => { isInput = false; });
  sendMessage(message);
};
window.setTimeout = (call, delay, ...rest) =>
  isInput && delay === 50 ? void call() : setTimeout(call, delay, ...rest);
// A box beside a slider would alter what is typed, too: it shows the number of the slider.
on(document, "focusin", (event) => {
  if (event.target.closest?.(".mantine-Slider-root + *")) event.target.readOnly = true;
});

const style = document.createElement("style");
style.textContent = settings.css;
document.head.append(style);

const strip = document.createElement("div");
strip.id = "tri-glide-strip";
strip.innerHTML =
  '<div class="head"><div class="state" role="status"></div><div class="limit" role="status"></div>' +
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

// A button with data-hold renews what it does, and says when it is released. The mouse, a key or a gamepad hold it: all
// of them go this way, one at a time.
let held = null;
let padIsFree = false; // what holds the dead-man button of a gamepad begins nothing before it was released
const release = () => {
  padIsFree = false;
  if (held === null) return;
  clearInterval(held.timer);
  held.button.classList.remove("held");
  held = null;
  press(settings.release);
};
const begin = (button, by) => {
  release();
  const send = () => {
    // Another tab of the panel is open, or the page shows other buttons by now.
    if (!button.offsetParent) release();
    else viser().sendMessage({ type: "GuiButtonHoldMessage", uuid: button.dataset.hold, frequency: settings.renewals });
  };
  held = { button, by, timer: setInterval(send, 1000 / settings.renewals) };
  button.classList.add("held");
  send();
};
const hold = (event) => {
  const button = event.target.closest?.("[data-hold]");
  if (!button || event.button !== 0 || !event.isPrimary) return;
  begin(button, "pointer");
  try { button.setPointerCapture(event.pointerId); } catch { /* it is gone already */ }
};
const releaseBy = (by) => { if (held !== null && held.by === by) release(); };
on(document, "pointerdown", hold);
for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) on(document, name, () => releaseBy("pointer"));
on(document, "contextmenu", (event) => { if (event.target.closest?.("[data-hold]")) event.preventDefault(); });
on(window, "blur", release);
on(window, "pagehide", () => { release(); press(settings.leave); });
on(document, "visibilitychange", () => { if (document.hidden) release(); else heard = performance.now(); });

// A key, or a direction of a gamepad, presses the button with this data-key: only one that is seen, while the operator has
// switched that on, and the page has the controls and the focus.
const buttonOf = (key) => {
  if (whyDead()) return null;
  return [...document.querySelectorAll("[data-key]")].find((each) => each.dataset.key === key && each.offsetParent) ?? null;
};
const whyDead = () => {
  if (!hasControls) return "this page does not have the controls";
  return document.hidden || !document.hasFocus() ? "this page is not in front" : "";
};
const isTyping = (target) =>
  target.closest?.("input:not([type=checkbox]), textarea, select, [contenteditable], [role=slider], [role=tab], [role=option], [role=combobox]");
on(window, "keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey || event.shiftKey || isTyping(event.target)) return;
  const button = buttonOf(event.key);
  if (!button) return;
  // viser would turn the camera by it, and the browser scroll.
  event.preventDefault();
  event.stopPropagation();
  // A key that is still held after a stop comes again and again.
  if (event.repeat) return;
  if (button.dataset.hold) begin(button, event.key);
  else press(button.dataset.press);
}, { capture: true });
on(window, "keyup", (event) => releaseBy(event.key), { capture: true });
// A click on a tab leaves the focus there, where arrows choose tabs. Who came by keys wants just that.
on(document, "click", (event) => { if (event.detail > 0) event.target.closest?.("[role=tab]")?.blur(); });

// What viser does not show: which buttons of groups are on, and whether keys act.
const mark = () => {
  const on = JSON.parse(document.querySelector("[data-on]")?.dataset.on ?? "{}");
  for (const button of document.querySelectorAll("button.mantine-Button-root")) {
    const isOn = String(on[button.textContent.trim()] ?? null);
    if (isOn !== "null" && button.ariaPressed !== isOn) button.ariaPressed = isOn;
  }
  const place = document.querySelector("[data-keys]");
  const why = whyDead() || (isTyping(document.activeElement ?? document) ? "a field or a tab has the focus" : "");
  const words = why ? `keys do nothing: ${why}` : "keys move the machine";
  if (place && place.textContent !== words) place.textContent = words;
};

// A gamepad (standard mapping): with a shoulder button held, the left stick or the cross moves along x and y, the right stick
// along z. Only where a stick is clearly pushed, and along one axis at a time, at the speed of the page.
const PUSHED = 0.5;
const directionOf = (pad) => {
  const is = (number) => Boolean(pad.buttons[number]?.pressed);
  const axis = (number) => pad.axes[number] ?? 0;
  const pushes = [
    ["ArrowRight", Math.max(axis(0), is(15))], ["ArrowLeft", Math.max(-axis(0), is(14))],
    ["ArrowDown", Math.max(axis(1), is(13))], ["ArrowUp", Math.max(-axis(1), is(12))],
    ["PageDown", axis(3)], ["PageUp", -axis(3)],
  ];
  const [key, push] = pushes.reduce((most, each) => (each[1] > most[1] ? each : most));
  return push > PUSHED ? key : null;
};
const lookAtPad = () => {
  const pad = [...navigator.getGamepads()].find((each) => each?.connected && each.mapping === "standard");
  const isHeld = pad && (pad.buttons[4]?.pressed || pad.buttons[5]?.pressed);
  if (!isHeld) {
    releaseBy("gamepad");
    padIsFree = Boolean(pad);
    return;
  }
  const key = directionOf(pad);
  const button = key && buttonOf(key);
  if (held?.by === "gamepad" && held.button !== button) {
    release();
    // The dead-man button is held on: another direction may follow.
    padIsFree = key === null || button !== null;
  }
  if (held === null && button?.dataset.hold && padIsFree) begin(button, "gamepad");
};
const padTimer = setInterval(lookAtPad, 1000 / settings.renewals);

// A button with data-press acts once.
on(document, "click", (event) => {
  const button = event.target.closest?.("[data-press]");
  if (button) press(button.dataset.press);
  // A tab of viser hears no click that is made here.
  const enter = new KeyboardEvent("keydown", { key: "Enter", bubbles: true });
  if (button?.closest(".history")) [...document.querySelectorAll("[role=tab]")].find((each) => each.textContent === "Curves")?.dispatchEvent(enter);
});

// Enter sends what stands in the field with data-line; the arrows up and down bring lines of before back.
let back = 0;
on(document, "keydown", (event) => {
  const field = event.target.closest?.("[data-line]");
  if (!field || event.isComposing) return;
  if (event.key === "Enter" && field.value.trim()) {
    viser().sendMessage({ type: "GuiUpdateMessage", uuid: field.dataset.line, updates: { value: field.value } });
    if (hasControls) field.value = "";
    back = 0;
  }
  const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  const lines = JSON.parse(document.querySelector("[data-lines]").dataset.lines);
  back = Math.min(Math.max(back + step, 0), lines.length);
  field.value = lines[back - 1] ?? "";
}, { capture: true });

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
  list.replaceChildren(...entries.map(({ time, color, text, log, count, press: shows }) => {
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
    if (shows) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = "recording";
      button.dataset.press = shows;
      item.append(" ", button);
    }
    return item;
  }));
};

let hasControls = false;
let heard = performance.now();
let told = {};
// Without news it is a sign of life: what was told last holds.
const show = (news = told) => {
  told = news;
  heard = performance.now();
  strip.dataset.color = told.color;
  hasControls = told.controls;
  for (const name of ["state", "limit", "position", "speed", "left", "reason", "refusal", "pages"]) {
    const place = strip.querySelector("." + name);
    if (place.textContent !== told[name]) place.textContent = told[name];
  }
  stop.querySelector("small").textContent = told.stop;
  document.body.classList.remove("tri-glide-lost");
};
// What a closed tab or a hidden page would show is not sent.
let tab = null;
const tellTab = () => {
  const open = document.hidden ? "" : document.querySelector("[role=tab][aria-selected=true]")?.textContent ?? "";
  if (open === tab) return;
  tab = open;
  viser().sendMessage({ type: "GuiUpdateMessage", uuid: settings.tab, updates: { value: `${Math.random()} ${open}` } });
};
// viser draws the scene for a quarter of a second after each script: ours change nothing in it.
const mine = viser(), draw = mine.requestRender;
mine.requestRender = () => {
  const waiting = mine.messageQueue;
  const isOurs = waiting.length > 0 && waiting.every((each) => each.type === "RunJavascriptMessage");
  if (isOurs) mine.drainMessageQueue();
  if (!isOurs || waiting.length) draw();
};
on(document, "visibilitychange", tellTab);
// viser gives no name to most of its fields, nor to buttons that are only an icon.
const nameControls = () => {
  for (const each of document.querySelectorAll("input:not([aria-label], [type=file]), [role=slider][aria-label='']")) {
    let row = each.parentElement;
    while (row && !row.querySelector("label")) row = row.parentElement;
    each.setAttribute("aria-label", row?.querySelector("label").textContent || "value");
  }
  for (const each of document.querySelectorAll("button:not([aria-label])")) {
    const icon = each.querySelector("svg")?.getAttribute("class")?.match(/tabler-icon-([a-z-]+)/)?.[1] ?? "close";
    if (!each.textContent) each.setAttribute("aria-label", icon === "adjustments" ? "settings of the page" : icon);
  }
};
const look = setInterval(() => {
  tellTab();
  nameControls();
  mark();
  // The canvas ends where viser's own panel begins.
  const canvas = document.querySelector("canvas");
  if (canvas) document.documentElement.style.setProperty("--strip-width", canvas.clientWidth + "px");
  const tabs = document.querySelector("[role=tablist]");
  if (tabs) document.documentElement.style.setProperty("--tabs-top", tabs.getBoundingClientRect().top + "px");
  if (document.hidden || performance.now() - heard < settings.silence) return;
  document.body.classList.add("tri-glide-lost");
  strip.dataset.color = "fault";
  strip.querySelector(".state").textContent = "no connection";
  for (const name of ["limit", "position", "speed", "left"]) strip.querySelector("." + name).textContent = "";
  hasControls = false;
  strip.querySelector(".reason").textContent = "The panel does not answer: what is shown is old, and nothing can be sent.";
  stop.querySelector("small").textContent = "no connection: use the emergency stop";
}, 250);

// viser's own parts follow the browser when the panel tells them to.
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const tellScheme = () => press(dark.matches ? settings.dark : settings.light);
on(dark, "change", tellScheme);
tellScheme();

window.triGlide = {
  show,
  sendPieces,
  history,
  get stopped() { return stopped; },
  remove: () => {
    listening.abort();
    window.setTimeout = setTimeout;
    clearInterval(look);
    clearInterval(padTimer);
    if (held) clearInterval(held.timer);
    mine.requestRender = draw;
    for (const each of [style, strip, stop]) each.remove();
  },
};
