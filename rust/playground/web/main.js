// The page: controls, the loop that steps the robot in real time or faster, and the pointer.
// Query parameters set the controls: ?model=spatial&task=field&driver=general&speed=4&seed=3.

import start, { Playground, policy_environment } from "./pkg/snake_playground.js";
import { Strip, bars } from "./charts.js";
import { View, between, groundPoint } from "./view.js";

const TASKS = {field: "random field of pegs", course: "course of the thesis", perturbed: "course, pegs out of place", maze: "lattice of posts", corridor: "corridor of pegs", clutter: "discs and boxes that can be pushed", free: "no pegs"};
// Policies that the Python package ships, and the tasks of each model that they are for.
const POLICIES = {
  planar: {general: ["field", "course", "perturbed", "maze", "corridor", "clutter"], isotropic: ["free"]},
  spatial: {spatial: ["free"], "spatial-field": ["field"]},
};
// What a double click adds: pegs of the session by their kind, or a patch by its factor of friction.
const TOOLS = {fixed: "a peg", spring: "a peg that yields", loose: "a disc to push", box: "a box to push", ball: "a ball to push", 0.1: "a patch of ice", "4.0": "a patch of rug"};
const PATCH = 0.3; // half a side [m]
const DEGREE = Math.PI / 180;
const PEG_RADIUS = 0.05; // of pegs that are added [m]
const BUDGET = 12; // of one picture for the simulation [ms]
const PAUSE_AFTER_GOAL = 1200; // [ms]
const DOUBLE = {time: 400, distance: 30}; // between two clicks or taps that belong together [ms, pixels]
const PRESETS = {
  sidewinding: {amplitude: 30, frequency: 80, phase_shift: -50, offset: 0, lift: 10, lift_phase: 90},
  rolling: {amplitude: 10, frequency: 80, phase_shift: 0, offset: 0, lift: 10, lift_phase: 90},
  undulation: {amplitude: 40, frequency: 80, phase_shift: -50, offset: 0, lift: 0, lift_phase: 90},
};
const SETTINGS = {
  difficulty: {label: "difficulty", low: 0, high: 1, step: 0.05, value: 0.5},
  links: {label: "links", low: 3, high: 60, step: 1, value: 11},
  along: {label: "friction along the links", low: 0.02, high: 1, step: 0.01, value: 0.2},
  across: {label: "friction across the links", low: 0.02, high: 1, step: 0.01, value: 0.2},
};

const $ = (id) => document.getElementById(id);
const query = new URLSearchParams(location.search);
const settings = Object.fromEntries(Object.entries(SETTINGS).map(([name, {value}]) => [name, value]));
const policies = {};
let robot, layout, view, strip, seed, before, after, forces, hand = null, tapped = null, patches = [];
let playing = true, owed = 0, last = 0, factor = 1, ended = 0, steerKeys = new Set();

function slider(parent, {name, label, low, high, step, value, unit = ""}, changed) {
  const row = document.createElement("label");
  row.className = "slider";
  row.innerHTML = `<span>${label}<output></output></span><input type="range" id="${name}" min="${low}" max="${high}" step="${step}">`;
  const input = row.querySelector("input"), output = row.querySelector("output");
  const show = () => { output.textContent = `${Number(input.value).toFixed(step < 0.1 ? 2 : 0)}${unit}`; };
  input.value = value;
  input.addEventListener("input", () => { show(); changed(Number(input.value)); });
  input.addEventListener("change", () => input.blur());
  show();
  parent.append(row);
  return {set: (to) => { input.value = to; show(); }, get: () => Number(input.value), row};
}

function config(driver = $("driver").value) {
  const friction = [settings.along, settings.across];
  const trained = policies[driver]?.env ?? {};
  const keys = ["perception", "nearest_pegs", "action_mode"].filter((key) => key in trained);
  return {
    model: $("model").value,
    task: $("task").value,
    difficulty: settings.difficulty,
    action_mode: "residual",
    perception: "body",
    nearest_pegs: 8,
    friction,
    robot: {links: settings.links},
    goal_distance: $("task").value === "free" ? 5 : 2,
    max_episode_steps: 2400,
    termination: {is_success: true, left_corridor: false},
    ...Object.fromEntries(keys.map((key) => [key, trained[key]])),
  };
}

// The same on ground with patches; the observation stays what it is.
function ground() {
  const {friction, ...rest} = config();
  return patches.length ? {...rest, scene: {friction, patches}, observation_blocks: layout.blocks} : {...rest, friction};
}

function tell(text, isError = false) {
  $("message").textContent = text;
  $("message").className = isError ? "error" : "";
}

// A new robot in the scene of the present seed.
function begin() {
  try {
    const made = new Playground(JSON.stringify(config()), seed);
    robot?.free();
    robot = made;
    layout = JSON.parse(robot.layout());
    if (patches.length) robot.reconfigure(JSON.stringify(ground()));
    view.setRobot(layout.links, $("model").value === "spatial");
    buildGait();
    chooseDriver();
    shown();
    tell("");
  } catch (error) {
    tell(error.message ?? String(error), true);
  }
}

// The same robot, on other ground.
function change() {
  try {
    robot.reconfigure(JSON.stringify(ground()));
  } catch (error) {
    tell(error.message ?? String(error), true);
  }
}

function restart() {
  robot.reset(seed);
  robot.release();
  steer();
  shown();
  tell("");
}

function showPegs() {
  view.setPegs(robot.pegs(), robot.springs(), robot.boxes(), robot.balls());
}

function shown() {
  before = after = robot.links();
  forces = robot.contact_force();
  owed = ended = 0;
  hand = null;
  strip.values.length = 0;
  showPegs();
  view.setPatches(patches);
  view.setGoal(robot.goal());
  view.look(centreOf(after), $("model").value === "spatial");
  view.showRobot(after, forces);
}

function centreOf(poses) {
  const sum = [0, 0], links = poses.length / 7;
  for (let k = 0; k < links; k++) {
    sum[0] += poses[7 * k] / links;
    sum[1] += poses[7 * k + 1] / links;
  }
  return sum;
}

const gait = {};

function buildGait() {
  // Policies may act on joints.
  const waves = new Playground(JSON.stringify(config("gait")), seed);
  const wave = JSON.parse(waves.layout()).action.filter((entry) => !entry.name.includes("offset_"));
  waves.free();
  const spatial = $("model").value === "spatial", resting = spatial ? {} : Object.fromEntries(Object.keys(gait).map((name) => [name, gait[name].get()]));
  if (Object.keys(gait).join() === wave.map((entry) => entry.name).join()) return;
  $("gait").replaceChildren();
  for (const name of Object.keys(gait)) delete gait[name];
  for (const entry of wave) {
    const [low, high, centre] = [entry.low, entry.high, entry.centre].map((value) => Math.round(value / DEGREE));
    const unit = entry.unit === "rad/s" ? "°/s" : "°", value = resting[entry.name] ?? centre;
    gait[entry.name] = slider($("gait"), {name: entry.name, label: entry.name.replace("_", " "), low, high, step: 1, value, unit}, takeOver);
    gait[entry.name].row.title = entry.meaning;
  }
  $("presets").replaceChildren();
  const presets = spatial ? Object.keys(PRESETS) : ["undulation"];
  for (const name of presets) {
    const button = document.createElement("button");
    button.textContent = name;
    button.id = `preset-${name}`;
    button.onclick = () => {
      for (const [key, value] of Object.entries(PRESETS[name])) gait[key]?.set(value);
      takeOver();
    };
    $("presets").append(button);
  }
}

// A slider of the gait was moved: the gait drives from now on.
function takeOver() {
  if ($("driver").value !== "gait") {
    const mode = config().action_mode;
    $("driver").value = "gait";
    if (mode === config().action_mode) change();
    else begin();
  }
  steer();
}

// Hands the sliders, and the arrow keys that are down, to the robot.
function steer() {
  if ($("driver").value !== "gait") return;
  const held = (name, low, high) => (steerKeys.has(high) ? 1 : 0) - (steerKeys.has(low) ? 1 : 0);
  const added = {offset: 12 * held("offset", "ArrowLeft", "ArrowRight"), frequency: 80 * held("frequency", "ArrowDown", "ArrowUp")};
  robot.use_gait(new Float64Array(Object.entries(gait).map(([name, control]) => (control.get() + (added[name] ?? 0)) * DEGREE)));
}

// The drivers that the present scene has; policies are for robots of 11 links. One that watches a policy goes on with one.
function listDrivers() {
  const fitting = settings.links === 11 ? Object.entries(POLICIES[$("model").value]) : [];
  const names = ["gait", ...fitting.filter(([, tasks]) => tasks.includes($("task").value)).map(([name]) => name)];
  const kept = $("driver").value;
  $("driver").replaceChildren(...names.map((name) => new Option(name === "gait" ? "the gait" : `policy "${name}"`, name)));
  $("driver").value = names.includes(kept) ? kept : names[1] ?? "gait";
}

// Discs and boxes move in the plane alone, balls in space.
function listTools() {
  const kept = $("tool").value, names = Object.keys(TOOLS).filter((name) => ($("model").value === "planar" ? name !== "ball" : ["fixed", "ball"].includes(name)) || name > 0);
  $("tool").replaceChildren(...names.map((name) => new Option(TOOLS[name], name)));
  $("tool").value = names.includes(kept) ? kept : "fixed";
}

function chooseDriver() {
  const name = $("driver").value;
  if (name === "gait") return steer();
  robot.use_policy(policies[name].bytes);
}

async function load(name) {
  if (name === "gait" || policies[name]) return;
  const bytes = new Uint8Array(await (await fetch(`policies/${name}.safetensors`)).arrayBuffer());
  policies[name] = {bytes, ...JSON.parse(policy_environment(bytes))};
}

async function newScene() {
  listDrivers();
  listTools();
  await load($("driver").value);
  begin();
}

// The friction that the task has in Python, or that the policy was trained with.
function naturalGround() {
  const task = $("task").value, planar = $("model").value === "planar";
  const slides = task === "maze" || task === "clutter" || (task === "free" && planar && $("driver").value === "gait");
  [settings.along, settings.across] = [0.2, slides ? 0.5 : 0.2];
  controls.along.set(settings.along);
  controls.across.set(settings.across);
}

const controls = {};

function buildControls() {
  $("task").replaceChildren(...Object.entries(TASKS).map(([name, label]) => new Option(label, name)));
  for (const [name, setting] of Object.entries(SETTINGS)) {
    controls[name] = slider($("settings"), {...setting, name}, (value) => {
      settings[name] = value;
      if (name === "links" || name === "difficulty") newScene();
      else change();
    });
  }
  $("model").onchange = () => { listDrivers(); naturalGround(); newScene(); };
  $("task").onchange = () => { listDrivers(); naturalGround(); newScene(); };
  $("driver").onchange = async () => { await load($("driver").value); naturalGround(); begin(); };
  $("play").onclick = () => setPlaying(!playing);
  $("restart").onclick = restart;
  $("next").onclick = () => { seed += 1; restart(); };
  $("more").onclick = () => document.body.classList.toggle("open");
  for (const button of $("steer").children) {
    const key = button.dataset.key;
    button.onpointerdown = () => { steerKeys.add(key); takeOver(); };
    button.onpointerup = button.onpointercancel = button.onpointerleave = () => { if (steerKeys.delete(key)) steer(); };
    button.oncontextmenu = (event) => event.preventDefault();
  }
}

function setPlaying(value) {
  playing = value;
  $("play").textContent = playing ? "Pause" : "Play";
}

function step() {
  robot.step();
  before = after;
  after = robot.links();
  strip.add(robot.residual());
  view.extendTrail(centreOf(after));
  showPegs();
  if (robot.has_ended() && !ended) {
    const {is_success, time} = JSON.parse(robot.signals());
    tell(is_success ? `Goal reached after ${time.toFixed(1)} s` : "The episode is over");
    ended = performance.now();
  }
}

// Steps as much time as has passed, as far as the budget of a picture allows.
function advance(now) {
  const period = layout.control_period, passed = Math.min(0.1, (now - last) / 1000);
  last = now;
  if (!playing) return;
  if (ended) {
    if (now - ended > PAUSE_AFTER_GOAL) {
      seed += 1;
      restart();
    }
    return;
  }
  owed += passed * Number($("speed").value);
  const begun = performance.now();
  let steps = 0;
  while (owed >= period && !ended && performance.now() - begun < BUDGET) {
    step();
    owed -= period;
    steps++;
  }
  const late = Math.floor(owed / period) * period; // time that cannot be caught up with
  factor += 0.03 * ((passed > 0 ? (steps * period) / passed : 0) - factor);
  owed -= late;
}

function draw() {
  const poses = between(before, after, Math.min(1, owed / layout.control_period));
  forces = robot.contact_force();
  view.follow(centreOf(poses));
  view.showRobot(poses, forces);
  view.showPull(hand?.kind === "link" ? poses.slice(7 * hand.index, 7 * hand.index + 3) : null, hand?.to?.toArray());
  view.draw();
}

function measure() {
  const torque = [...robot.joint_torque()], limit = layout.torque_limit ?? 10;
  const size = Array.from({length: forces.length / 3}, (_, k) => Math.hypot(...forces.slice(3 * k, 3 * k + 3)));
  strip.draw();
  bars($("forces"), size, 80, false);
  bars($("torques"), torque, limit, true);
  $("residual").textContent = robot.residual().toExponential(1);
  $("force").textContent = `max ${Math.max(...size).toFixed(1)}`;
  $("torque").textContent = `max ${Math.max(...torque.map(Math.abs)).toFixed(1)}`;
  const {time, speed} = JSON.parse(robot.signals());
  $("status").textContent = `${time.toFixed(1)} s · ${(100 * speed).toFixed(1)} cm/s · ${factor.toFixed(1)} × real time`;
}

function frame(now) {
  requestAnimationFrame(frame);
  if (!robot) return;
  advance(now);
  draw();
  measure();
}

// The pointer takes hold of pegs and links before the camera does.
function press(event) {
  if (event.button !== 0) return;
  const hit = view.pick(event);
  if (!hit) return;
  view.controls.enabled = false;
  view.canvas.setPointerCapture(event.pointerId);
  hand = hit;
  if (hit.kind === "peg") {
    const [, x, y] = robot.pegs().slice(3 * hit.index, 3 * hit.index + 3);
    hand.offset = groundPoint(x, y).sub(view.onPlane(event, hit.point));
  }
  drag(event);
}

function drag(event) {
  if (!hand) return;
  const facing = hand.kind === "link" && $("model").value === "spatial";
  const point = view.onPlane(event, hand.point, facing);
  if (!point) return;
  if (hand.kind === "peg") {
    robot.move_peg(hand.index, point.x + hand.offset.x, point.y + hand.offset.y);
    showPegs();
  } else {
    hand.to = point;
    robot.pull(hand.index, point.x, point.y, point.z);
  }
}

function letGo(event) {
  robot.release();
  hand = null;
  view.controls.enabled = true;
  if (event.type === "pointerup" && isSecond(event)) addOrRemove(event);
}

// Whether a click or tap follows another one at the same place; browsers tell it of fingers only in part.
function isSecond(event) {
  const {clientX: x, clientY: y, timeStamp: time} = event, last = tapped;
  tapped = {x, y, time};
  if (!last || time - last.time > DOUBLE.time || Math.hypot(x - last.x, y - last.y) > DOUBLE.distance) return false;
  tapped = null;
  return true;
}

function addOrRemove(event) {
  const hit = view.pick(event), tool = $("tool").value;
  if (hit?.kind === "peg") robot.remove_peg(hit.index);
  else if (!hit) {
    const point = view.onPlane(event, groundPoint(0, 0));
    if (point && tool > 0) changePatch(point, Number(tool));
    else if (point) robot.add_peg(tool, PEG_RADIUS, point.x, point.y);
  }
  showPegs();
}

// Takes away the patches at a point, or makes one around it.
function changePatch({x, y}, factor) {
  const away = ({vertices}) => Math.abs(x - vertices[0][0] - PATCH) > PATCH || Math.abs(y - vertices[0][1] - PATCH) > PATCH;
  const left = patches.filter(away);
  const [w, e, s, n] = [x - PATCH, x + PATCH, y - PATCH, y + PATCH];
  patches = left.length < patches.length ? left : [...patches, {vertices: [[w, s], [e, s], [e, n], [w, n]], factor}];
  change();
  view.setPatches(patches);
}

function listen() {
  const canvas = view.canvas;
  // Before the listener of the camera.
  canvas.addEventListener("pointerdown", press, {capture: true});
  canvas.addEventListener("pointermove", drag);
  canvas.addEventListener("pointerup", letGo);
  canvas.addEventListener("pointercancel", letGo);
  window.addEventListener("keydown", (event) => {
    if (event.key === " ") setPlaying(!playing);
    else if (event.key.startsWith("Arrow")) {
      steerKeys.add(event.key);
      takeOver();
    } else return;
    event.preventDefault();
  });
  window.addEventListener("keyup", (event) => {
    if (steerKeys.delete(event.key)) steer();
  });
}

async function main() {
  await start();
  view = new View($("view"));
  strip = new Strip($("residuals"), [1e-15, 1e-3]);
  buildControls();
  seed = Number(query.get("seed") ?? 1);
  for (const name of ["model", "task", "speed"]) if (query.has(name)) $(name).value = query.get(name);
  for (const name of Object.keys(SETTINGS)) {
    if (query.has(name)) controls[name].set(settings[name] = Number(query.get(name)));
  }
  listDrivers();
  if (query.has("driver")) $("driver").value = query.get("driver");
  if (!$("driver").value) $("driver").value = "gait";
  if (!query.has("along") && !query.has("across")) naturalGround();
  await newScene();
  listen();
  setPlaying(query.get("paused") === null);
  requestAnimationFrame((now) => { last = now; frame(now); });
  // For tests and the curious.
  window.playground = {get robot() { return robot; }, get patches() { return patches; }, view, settings, step: () => { step(); draw(); }, setPlaying};
}

main().catch((error) => tell(`The playground did not start: ${error.message ?? error}`, true));
