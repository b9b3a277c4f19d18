/** The page of the pole on a cart: an agent in C learns, a hand disturbs it. */
import { SPEEDS, begin, disc, drawChart, element, isMotionReduced, line, loadModule, pictureInterval, showCommand, showError, speedText } from "./page.js";

const STEPS_PER_SECOND = 50;
const MOST_STEPS = 500;
const MAX_POSITION = 2.4; // m
const BUSY_MILLISECONDS = 10; // of calculation in a frame
const PUSH = 7; // N; the agent pushes with 10
const RANGES = "--range -2.4:2.4 --range -3:3 --range -0.21:0.21 --range -3.5:3.5";
const MOST_POINTS = 300; // of the curve
const RAM = [20000, 60000, 120000];

let core = null;
let isRunning = !isMotionReduced();
let isDirty = true;
let tests = []; // [steps, length] of every `stride`-th test, which doubles to keep the curve short
let nTests = 0;
let stride = 1;
let lastTest = null;
let nSteps = 0;
let due = 0; // steps that real time has reached and that are not made yet
let lastFrame = 0;
let lastPicture = -Infinity;
let hand = 0; // -1: pushes to the left, 1: to the right
let seed = 0;

const copies = () => Number(element("copies").value);
const speed = () => SPEEDS[element("speed").value];

function showSettings() {
  element("noise-text").value = `${(100 * element("noise").value).toFixed(1)} %`;
  element("copies-text").value = copies();
  element("speed-text").value = speedText(speed());
  element("speed").setAttribute("aria-valuetext", element("speed-text").value);
  element("run").textContent = isRunning ? "Pause" : "Start";
  const ranges = Array(copies()).fill(RANGES).join(" ");
  const header = `sdnn export --new ${ranges} --actions 2 --ram ${RAM[copies() - 1]} --c-header pole.h`;
  showCommand(element("command"), header);
}

function restart() {
  core.set_noise(Number(element("noise").value));
  core.begin(copies(), seed++);
  tests = [];
  lastTest = null;
  stride = 1;
  nTests = nSteps = due = 0;
  element("memory").textContent = `${(core.agent_bytes() / 1000).toFixed(0)} kB`;
  isDirty = true;
  showSettings();
}

function step() {
  nSteps++;
  if (!core.step() || !core.last_is_test()) return;
  lastTest = core.last_length();
  if (nTests++ % stride === 0) tests.push([nSteps, lastTest]);
  if (tests.length > MOST_POINTS) {
    tests = tests.filter((_, i) => i % 2 === 0);
    stride *= 2;
  }
}

function learn(now) {
  due = speed() === Infinity ? Infinity : due + (Math.min(now - lastFrame, 100) / 1000) * STEPS_PER_SECOND * speed();
  const begun = performance.now();
  for (; due >= 1 && performance.now() - begun < BUSY_MILLISECONDS; due--) step();
  if (due > 100) due = 0; // this machine is slower: forget what it cannot reach
  isDirty = true;
}

function drawPicture() {
  const { context, width, height, color } = begin(element("picture"));
  const scale = Math.min(width / (2 * MAX_POSITION + 1), height / 1.9);
  const [ground, x] = [0.8 * height, width / 2 + scale * core.position()];
  const reach = scale * MAX_POSITION;
  line(context, [[width / 2 - reach, ground], [width / 2 + reach, ground]], color("faint"), 2);
  const top = ground - 0.3 * scale;
  context.fillStyle = color("text");
  context.fillRect(x - 0.3 * scale, top, 0.6 * scale, 0.22 * scale);
  for (const side of [-1, 1]) disc(context, x + 0.18 * side * scale, ground - 0.06 * scale, 0.07 * scale, color("faint"));
  const angle = core.angle();
  line(context, [[x, top], [x + scale * Math.sin(angle), top - scale * Math.cos(angle)]], color("first"), 0.08 * scale);
  disc(context, x, top, 0.05 * scale, color("second"));
  if (hand) drawHand(context, x - hand * 0.34 * scale, top + 0.1 * scale, hand, scale, color("second"));
}

/** Draw a flat hand with its arm, which pushes in the direction. */
function drawHand(context, x, y, direction, scale, color) {
  line(context, [[x, y - 0.14 * scale], [x, y + 0.1 * scale]], color, 0.08 * scale);
  line(context, [[x, y], [x - 0.45 * direction * scale, y]], color, 0.1 * scale);
}

function draw(now) {
  requestAnimationFrame(draw);
  if (isRunning) learn(now);
  lastFrame = now;
  if (!isDirty || now - lastPicture < pictureInterval()) return;
  isDirty = false;
  lastPicture = now;
  drawPicture();
  element("progress").textContent = `${nSteps.toLocaleString("en")} steps in all, ${core.n_steps()} in this episode`;
  const end = Math.ceil(Math.max(nSteps, 10000) / 10000) * 10000;
  drawChart(element("chart"), [tests], { x: end, y: MOST_STEPS, label: "steps" });
  element("summary").textContent = lastTest === null ? "" : `The last test had ${lastTest}.`;
}

function push(direction) {
  hand = direction;
  core?.push(PUSH * direction);
  isDirty = true;
}

function holdToPush(button, direction) {
  button.onpointerdown = () => push(direction);
  button.onkeydown = (event) => { if (event.key === " " || event.key === "Enter") push(direction); };
  for (const event of ["pointerup", "pointerleave", "pointercancel", "keyup", "blur"]) {
    button.addEventListener(event, () => push(0));
  }
}

/** Push away from where the canvas is pressed. */
function pressBeside(event) {
  const canvas = element("picture");
  const scale = Math.min(canvas.clientWidth / (2 * MAX_POSITION + 1), canvas.clientHeight / 1.9);
  const cart = canvas.clientWidth / 2 + scale * core.position();
  push(event.offsetX < cart ? 1 : -1);
}

async function start() {
  core = await loadModule("pole.wasm");
  for (const id of ["run", "restart"]) element(id).disabled = false;
  element("run").onclick = () => {
    isRunning = !isRunning;
    showSettings();
  };
  element("restart").onclick = element("copies").oninput = restart;
  element("speed").oninput = () => {
    due = 0;
    showSettings();
  };
  element("noise").oninput = () => {
    core.set_noise(Number(element("noise").value));
    showSettings();
  };
  element("settings").onsubmit = (event) => event.preventDefault();
  element("picture").onpointerdown = pressBeside;
  for (const event of ["pointerup", "pointercancel", "pointerleave"]) element("picture").addEventListener(event, () => push(0));
  holdToPush(element("push-left"), -1);
  holdToPush(element("push-right"), 1);
  matchMedia("(prefers-color-scheme: dark)").onchange = () => { isDirty = true; };
  addEventListener("resize", () => { isDirty = true; });
  restart();
  requestAnimationFrame(draw);
}

start().catch(showError);
